"""Join three films of two seconds each to the film of the landing page.

docs/pictures/landing.webp was made from these films::

    snakewalk capture FRAMES --cropped --overlay worm.mp4
    snakewalk play worm-like
    snakewalk run jacksboro-traverse
"""

import argparse
from pathlib import Path

import av
from PIL import Image, ImageDraw, ImageFont, ImageOps

WIDTH, HEIGHT = 640, 360
PART_S = 2.0
RATE_HZ = 10
CAPTIONS = (
    "1  A worm and its skeleton",
    "2  Its shapes on the simulated robot",
    "3  The robot crosses measured hills",
)


def part(film: Path, caption: str) -> list[Image.Image]:
    """Return frames from the whole length of ``film``, with a caption."""
    with av.open(str(film)) as file:
        frames = [frame.to_image() for frame in file.decode(video=0)]
    count = int(PART_S * RATE_HZ)
    shown = []
    for k in range(count):
        frame = frames[round(k / (count - 1) * (len(frames) - 1))]
        turned = frame.rotate(90, expand=True) if frame.height > frame.width else frame
        image = ImageOps.pad(turned, (WIDTH, HEIGHT), color="black")
        draw = ImageDraw.Draw(image)
        draw.rectangle((0, HEIGHT - 36, WIDTH, HEIGHT), fill="black")
        draw.text((12, HEIGHT - 31), caption, fill="white", font=ImageFont.load_default(22))
        shown.append(image)
    return shown


def landing(films: list[Path], picture: Path) -> None:
    """Write the parts one after the other as an animated WebP."""
    frames = [
        frame
        for film, caption in zip(films, CAPTIONS, strict=True)
        for frame in part(film, caption)
    ]
    rest = {"save_all": True, "append_images": frames[1:], "loop": 0}
    frames[0].save(picture, duration=1000 // RATE_HZ, quality=55, method=6, **rest)
    print(f"{picture}: {picture.stat().st_size // 1024} kB")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("film", type=Path, nargs=3, help="worm, play and run, in this order")
    options.add_argument("picture", type=Path, help=".webp")
    given = options.parse_args()
    landing(given.film, given.picture)
