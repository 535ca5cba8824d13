"""Sections of a path that are too steep for a body to climb."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.terrain.path import SplinePath

CLIMBED_RAD = float(np.radians(15.5))
"""Steepest ground that waves of the walk are known to climb: 20 of 20 runs complete a plane of 15
degrees, and 0 of 6 one of 18 degrees (docs/terrain.md). Rolls climb steeper ground."""
_STEP_M = 0.02


@dataclass(frozen=True, slots=True)
class SteepSection:
    """Part of a path on which the ground under the body rises more than a limit."""

    begin_m: float
    """Arc length of the middle of the body at its begin."""
    end_m: float
    slope_rad: float
    """Steepest mean slope along the path under a body there."""


def steep_sections(
    path: SplinePath, ground: HeightField, length_m: float, limit_rad: float
) -> list[SteepSection]:
    """Return the sections on which a body of ``length_m`` climbs steeper than ``limit_rad``.

    The slope is the rise from tail to head over the body's length along the path, so low steps
    pass. Slopes downwards are not reported.
    """
    half_m = 0.5 * min(length_m, path.length_m)
    middle_m = np.arange(half_m, path.length_m - half_m + _STEP_M / 2, _STEP_M)
    tail, head = (
        ground.elevation_m(*path.position(np.minimum(middle_m + at_m, path.length_m)).T)
        for at_m in (-half_m, half_m)
    )
    slope_rad = np.arctan((head - tail) / (2.0 * half_m))
    is_steep = np.concatenate([[False], slope_rad > limit_rad, [False]])
    begins, ends = np.flatnonzero(np.diff(is_steep)).reshape(-1, 2).T
    return [
        SteepSection(
            float(middle_m[begin]), float(middle_m[end - 1]), float(slope_rad[begin:end].max())
        )
        for begin, end in zip(begins, ends, strict=True)
    ]
