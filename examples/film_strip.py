"""Four stills of a film beside each other: `python examples/film_strip.py FILM.mp4 OUT.jpg`."""

import sys
from pathlib import Path

import av
from PIL import Image

STILLS = 4
WIDTH, HEIGHT = 480, 270


def strip(film: Path, picture: Path) -> None:
    """Write the stills of ``film`` at even times, two in a row."""
    with av.open(str(film)) as file:
        frames = list(file.decode(video=0))
    sheet = Image.new("RGB", (2 * WIDTH, STILLS // 2 * HEIGHT))
    for k in range(STILLS):
        still = frames[round((k + 0.5) / STILLS * (len(frames) - 1))].to_image()
        sheet.paste(still.resize((WIDTH, HEIGHT)), (k % 2 * WIDTH, k // 2 * HEIGHT))
    sheet.save(picture, quality=82)


if __name__ == "__main__":
    strip(Path(sys.argv[1]), Path(sys.argv[2]))
