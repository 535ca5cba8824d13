"""Put four stills of a film beside each other."""

import argparse
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
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("film", type=Path)
    options.add_argument("picture", type=Path, help=".jpg or .png")
    given = options.parse_args()
    strip(given.film, given.picture)
