"""An uncalibrated lens above printed markers: how often it is reported, and false reports.

``python -m benchmarks.uncalibrated_lens``. Corners are projected, without pictures: 0.15 px of
noise, places measured to 3 mm, prints of 98 or 100 % of their size, tilts of 0 to 15 degrees.
Only cameras that show four markers or more completely count.
"""

import os
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from snakewalk.config.arrays import Floats
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.markers.floor_markers import FEWEST
from snakewalk.controller.cameras.markers.lens_residual import marker_distortion

FIVE: Final = {0: (-2.6, -1.9), 1: (2.6, -1.9), 2: (2.6, 1.9), 3: (-2.6, 1.9), 4: (0.0, 1.9)}
FOUR: Final = {name: FIVE[name] for name in range(4)}
_HEIGHT_M, _SIDE_M, _NOISE_PX, _PLACE_M = 6.0, 0.15, 0.15, 0.003
_SQUARE = np.array([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]])
LENSES: Final = {0.0: 100, -0.03: 20, -0.05: 20, -0.1: 20, -0.3: 20, -0.5: 20}
"""k1 to the number of cameras."""


def seen(
    places: dict[int, tuple[float, float]], width_px: int, k1: float, chance: np.random.Generator
) -> tuple[dict[int, Floats], tuple[int, int]]:
    """Corners of the markers that a picture shows completely, and its size."""
    size = width_px, width_px * 3 // 4
    matrix = np.array([
        [width_px, 0.0, 0.5 * (size[0] - 1)], [0.0, width_px, 0.5 * (size[1] - 1)], [0.0, 0.0, 1.0]
    ])  # fmt: skip
    lens = Lens(size, matrix, np.array([k1, 0.0, 0.0, 0.0, 0.0]))
    axis = chance.normal(size=3) * (1.0, 1.0, 0.2)
    tilt = np.radians(chance.choice([0.0, 2.0, 6.0, 15.0])) / np.linalg.norm(axis)
    rotation, _ = cv2.Rodrigues(axis * tilt)
    side_m = _SIDE_M * chance.choice([1.0, 0.98])
    corners = {}
    for name, place in places.items():
        c, s = np.cos(turn := chance.uniform(0.0, 2.0 * np.pi)), np.sin(turn)
        floor = np.array(place) + chance.normal(0.0, _PLACE_M, 2)
        floor = floor + side_m * _SQUARE @ np.array([[c, s], [-s, c]])
        points = np.column_stack([floor[:, 0], -floor[:, 1], np.full(4, _HEIGHT_M)]) @ rotation.T
        px = points @ matrix.T
        px = lens.distorted(px[:, :2] / px[:, 2:]) + chance.normal(0.0, _NOISE_PX, (4, 2))
        if ((px >= 0.0) & (px <= np.subtract(size, 1))).all():
            corners[name] = px
    return corners, size


def main() -> None:
    """Measure and show."""
    seed = int(os.environ.get("SEED", "1000"))
    table = Table("markers", "width", *(f"k1 = {k1:g}" for k1 in LENSES), box=None)
    for places in (FIVE, FOUR):
        for width_px in (320, 640, 1280, 1920):
            row = []
            for k1, count in LENSES.items():
                chance = np.random.default_rng((seed, width_px, len(places), round(-100 * k1)))
                found = []
                for _ in range(count):
                    corners, size = seen(places, width_px, k1, chance)
                    if len(corners) >= FEWEST:
                        found.append(marker_distortion(corners, places, size, _SIDE_M))
                reported = sum(one is not None and one.is_certain for one in found)
                row.append(f"{reported} of {len(found)}")
            table.add_row(str(len(places)), str(width_px), *row)
    Console().print(table)


if __name__ == "__main__":
    main()
