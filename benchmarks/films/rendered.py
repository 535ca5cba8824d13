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


def scenes(seed: int = 0) -> dict[str, SnakeScene]:
    """Scenes by name; seeds above 0 change noise, ground and the body's length, width and waves.

    Constants were chosen on seed 0.
    """
    if not seed:
        return SCENES
    drawn = {}
    for number, (name, usual) in enumerate(SCENES.items()):
        rng = np.random.default_rng([seed, number])
        drawn[name] = replace(
            usual,
            seed=int(rng.integers(1_000_000)),
            length_px=usual.length_px * float(rng.uniform(0.8, 1.25)),
            slender=usual.slender * float(rng.uniform(0.8, 1.25)),
            waves=float(rng.uniform(0.9, 1.6)),
            taper=float(rng.uniform(0.15, 0.5)),
        )
    return drawn


def write_rendered(folder: Path, seed: int = 0) -> None:
    """Write each scene as a folder of pictures, its midlines and its description."""
    for name, scene in scenes(seed).items():
        place = folder / name / "frames"
        place.mkdir(parents=True)
        for k, image in enumerate(film(scene)):
            cv2.imwrite(str(place / f"{k:05d}.png"), image)
        np.savez(folder / name / "midlines.npz", midlines=true_midlines(scene))
        text = (
            f'film = "frames"\nlines = "midlines.npz"\noptions = ["--rate", "{scene.rate_hz:g}"]\n'
        )
        (folder / name / "film.toml").write_text(text + 'source = "rendered"\n', encoding="utf-8")
