"""Capture of bodies whose parts differ in contrast or width: bands, faint tails, wide heads.

python -m benchmarks.uneven_bodies --seeds 20              # as a Markdown table
python -m benchmarks.uneven_bodies --only pointed --seeds 3
"""

import argparse
from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.images.body_detector import make_detector
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines
from tests.oracles.skeleton_accuracy import point_error, swapped

PLAIN = SnakeScene(rows=240, columns=320, frames=12, rate_hz=15.0, wave_hz=0.6)
_LARVA: dict[str, Any] = {"head": 1.8, "faint": 0.15, "tip": 0.05, "taper": 0.6}
KINDS: dict[str, dict[str, Any]] = {
    "round tail, 180 px": {"length_px": 180.0, "rows": 320, "columns": 400},
    "pointed tail, 180 px": {"length_px": 180.0, "rows": 320, "columns": 400, "tip": 0.0},
    "pointed tail, 100 px": {"length_px": 100.0, "tip": 0.0},
    "6 bands, 140 px": {"length_px": 140.0, "rows": 300, "columns": 360, "bands": 6},
    "5 bands, 90 px": {"length_px": 90.0, "bands": 5},
    "faint tail, 140 px": {"length_px": 140.0, "rows": 300, "columns": 360, "faint": 0.3},
    "wide head, 140 px": {"length_px": 140.0, "rows": 300, "columns": 360, "head": 2.0},
    "larva, 160 px": {"length_px": 160.0, "rows": 320, "columns": 400, "slender": 20.0, **_LARVA},
    "larva, 90 px": {"length_px": 90.0, "slender": 18.0, **_LARVA},
}
_TRUE = 2.0  # times the expected error


def row(name: str, seeds: int) -> str:
    """One line of the table."""
    frames = used = good = false = swaps = 0
    off: list[float] = []
    for seed in range(seeds):
        scene = replace(PLAIN, seed=seed, **KINDS[name])
        images, truth = list(film(scene)), true_midlines(scene)
        frames += len(images)
        try:
            seen = capture(images, make_detector(images), scene.rate_hz)
        except InputError:
            continue
        for k in np.flatnonzero(seen.used):
            turned = swapped(seen.points_px[k], truth[k])
            error = point_error(seen.points_px[k][:: -1 if turned else 1], truth[k])
            used, swaps = used + 1, swaps + turned
            good += bool(seen.good[k])
            false += bool(seen.good[k] and error > _TRUE * seen.expected_px[k])
            off.append(100.0 * error / scene.length_px)
    middle = f"{np.median(off):.2f}" if off else "-"
    return f"| {name} | {used} of {frames} | {good} | {false} | {swaps} | {middle} |"


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", default="", help="part of a kind's name")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    print("| body | frames used | good | good, yet off > 2 x expected | swapped | off, % |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in KINDS:
        if given.only in name:
            print(row(name, given.seeds), flush=True)


if __name__ == "__main__":
    main()
