"""Rendered films with their midlines, written as a folder of described films."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.capture import DISTURBED, PLAIN, STRANGE
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines

SCENES: dict[str, SnakeScene] = {
    "plain-50": replace(PLAIN, length_px=50.0),
    "plain-150": replace(PLAIN, rows=480, columns=640, length_px=150.0),
    "shadow-100": replace(PLAIN, length_px=100.0, shadow=0.3),
    **{
        f"strange-{number}": replace(STRANGE, length_px=100.0, frames=24, **DISTURBED[name])
        for number, name in enumerate(DISTURBED)
    },
}


def write_rendered(folder: Path) -> None:
    """Write each scene as a folder of pictures, its midlines and its description."""
    for name, scene in SCENES.items():
        place = folder / name / "frames"
        place.mkdir(parents=True)
        for number, image in enumerate(film(scene)):
            cv2.imwrite(str(place / f"{number:05d}.png"), image)
        np.savez(folder / name / "midlines.npz", midlines=true_midlines(scene))
        text = (
            f'film = "frames"\nlines = "midlines.npz"\noptions = ["--rate", "{scene.rate_hz:g}"]\n'
        )
        (folder / name / "film.toml").write_text(text + 'source = "rendered"\n', encoding="utf-8")
