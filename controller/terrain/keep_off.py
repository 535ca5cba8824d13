"""Distance that paths keep from the obstacle of a world."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import Obstacle
from snakewalk.controller.terrain.path import SplinePath

_SPACING_M = 0.05
_BEYOND_M = 1.0
_CROWDED = 5.0
"""Additional cost of a metre on which the wave touches an obstacle, metres of path (ours)."""
_FALL_M = 0.1


@dataclass(frozen=True, slots=True)
class KeepOff:
    """Obstacle, and the body that passes it."""

    obstacle: Obstacle
    radius_m: float
    """Radius of the body: no path leads nearer."""
    reach_m: float
    """Distance of the side of the body from its middle line, which paths keep where they can."""

    def distance_text(self, path: SplinePath) -> str:
        """Return the least distance of a path, and whether the body touches the obstacle."""
        gap_m = self.obstacle.gap_m(*path.piece_m(0.0, path.length_m).T).min()
        ends = "touches" if gap_m < self.reach_m else "clears"
        return (
            f"{self.obstacle.kind}, {gap_m:.2f} m from the path: a wave that reaches "
            f"{self.reach_m:.2f} m to the side {ends} it"
        )

    def layers(self, ground: HeightField) -> tuple[Floats, Floats]:
        """Risk (rows, columns) and additional cost (rows, columns) on the samples of a ground."""
        gap_m = np.minimum(self.obstacle.gap_m(*np.meshgrid(*ground.axes_m)), 1e3)
        cost = np.clip(1.0 - (gap_m - self.reach_m) / _FALL_M, 0.0, 1.0)
        return 2.0 - gap_m / self.radius_m, _CROWDED * cost


def level_ground(size_m: float, points_m: Floats) -> HeightField:
    """Return a level floor around (0, 0) that contains points (n, 2)."""
    half_m = max(0.5 * size_m, float(np.abs(points_m).max()) + _BEYOND_M)
    count = 2 * int(np.ceil(half_m / _SPACING_M)) + 1
    edge_m = -_SPACING_M * (count // 2)
    return HeightField(np.zeros((count, count)), _SPACING_M, edge_m, edge_m)
