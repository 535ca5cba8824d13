"""Join three parts of two seconds each to the film of the landing page.

docs/pictures/landing.webp was made from these results::

    snakewalk animal capture FRAMES --cropped -o track.npz
    snakewalk play worm-like
    snakewalk run jacksboro-traverse
"""

import argparse
from pathlib import Path

import av
import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

WIDTH, HEIGHT, CAPTION = 640, 360, 36
"""Size of a picture, and height of the caption below it, in pixels."""
PART_S = 2.0
RATE_HZ = 10
CAPTIONS = (
    "1  A worm and its skeleton",
    "2  Its shapes on the simulated robot",
    "3  The robot crosses measured hills",
)


SKELETON, HEAD = (255, 200, 40), (60, 230, 90)


def chosen(total: int) -> list[int]:
    """Return the numbers of evenly spread frames, from the first to the last of ``total``."""
    count = int(PART_S * RATE_HZ)
    return [round(k / (count - 1) * (total - 1)) for k in range(count)]


def captioned(image: Image.Image, caption: str) -> Image.Image:
    """Write ``caption`` below ``image``."""
    canvas = Image.new("RGB", (WIDTH, HEIGHT + CAPTION), "black")
    canvas.paste(image)
    draw = ImageDraw.Draw(canvas)
    draw.text((12, HEIGHT + 5), caption, fill="white", font=ImageFont.load_default(22))
    return canvas


def film_part(film: Path, caption: str) -> list[Image.Image]:
    """Return frames from the whole length of ``film``, with a caption."""
    with av.open(str(film)) as file:
        frames = [frame.to_image() for frame in file.decode(video=0)]
    size = (WIDTH, HEIGHT)
    return [
        captioned(ImageOps.pad(frames[k], size, color="black"), caption)
        for k in chosen(len(frames))
    ]


def animal_part(folder: Path, track: Path, caption: str) -> list[Image.Image]:
    """Return frames of ``folder``, each centred on its skeleton from ``track``, at one scale.

    The frames are turned to the left by 90 degrees. The area outside a cropped frame has the
    median grey value of the frame.
    """
    files = sorted(folder.iterdir())
    all_px = np.load(track)["points_px"]  # (frames, 101, 2): x, y
    high_px, wide_px = np.ptp(all_px, axis=1).max(axis=0)
    zoom = float(min(0.9 * WIDTH / wide_px, 0.9 * HEIGHT / high_px))
    middle = np.array([WIDTH, HEIGHT]) / 2.0
    shown = []
    for k in chosen(len(files)):
        image = Image.open(files[k]).convert("L")
        points_px = np.column_stack([all_px[k, :, 1], image.width - 1.0 - all_px[k, :, 0]])
        corner = middle - zoom * ((points_px.min(axis=0) + points_px.max(axis=0)) / 2.0 + 0.5)
        image = image.transpose(Image.Transpose.ROTATE_90)
        canvas = Image.new("L", (WIDTH, HEIGHT), int(np.median(np.asarray(image))))
        large = image.resize((round(image.width * zoom), round(image.height * zoom)))
        canvas.paste(large, (round(corner[0]), round(corner[1])))
        colour = canvas.convert("RGB")
        draw = ImageDraw.Draw(colour)
        line = [(float(x), float(y)) for x, y in corner + zoom * (points_px + 0.5)]
        draw.line(line, fill=SKELETON, width=4, joint="curve")
        draw.circle(line[0], 7, fill=HEAD)
        shown.append(captioned(colour, caption))
    return shown


def landing(folder: Path, track: Path, films: list[Path], picture: Path) -> None:
    """Write the parts one after the other as an animated WebP."""
    frames = animal_part(folder, track, CAPTIONS[0])
    for film, caption in zip(films, CAPTIONS[1:], strict=True):
        frames += film_part(film, caption)
    rest = {"save_all": True, "append_images": frames[1:], "loop": 0}
    frames[0].save(picture, duration=1000 // RATE_HZ, quality=55, method=6, **rest)
    print(f"{picture}: {picture.stat().st_size // 1024} kB")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("frames", type=Path, help="folder of the frames of the animal")
    options.add_argument("track", type=Path, help="track.npz of these frames")
    options.add_argument("film", type=Path, nargs=2, help="films of play and run, in this order")
    options.add_argument("picture", type=Path, help=".webp")
    given = options.parse_args()
    landing(given.frames, given.track, given.film, given.picture)
