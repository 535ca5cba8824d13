"""Rounded polygons: paths that never leave the triangles of their corners.

A cubic through points overshoots. Here a parabola between points of two sides replaces each corner,
and stays inside their triangle.
"""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath

_STEP_M = 0.01
_LONGEST_SIDE_M = 1.0
"""Longest part of a side that a bend uses (ours)."""
_HALVINGS = 10
_CORNER_UNITS = 500


def rounded(corners_m: Floats, free: Bools, safe: Callable[[Floats], Bools]) -> Steps[SplinePath]:
    """Path along a polygon whose free corners are rounded as widely as ``safe`` allows.

    Args:
        corners_m: (n, 2) consecutive distinct points.
        free: (n,) corners that the path need not pass; the others stay sharp.
        safe: whether each of points (k, 2) is on safe ground.

    """
    sides = np.diff(corners_m, axis=0)
    length = np.hypot(*sides.T)
    pieces = [corners_m[:1]]
    for k in range(1, len(corners_m) - 1):
        pieces.append(corners_m[k : k + 1])
        if not free[k]:
            continue
        yield _CORNER_UNITS
        back = -sides[k - 1] / length[k - 1]
        onward = sides[k] / length[k]
        reach = min(0.5 * length[k - 1], 0.5 * length[k], _LONGEST_SIDE_M)
        for _ in range(_HALVINGS):
            bend = _bend(corners_m[k], back * reach, onward * reach)
            if safe(bend).all():
                pieces[-1] = bend
                break
            reach *= 0.5
    pieces.append(corners_m[-1:])
    yield _CORNER_UNITS
    return SplinePath.tabulated(_with_even_points(np.vstack(pieces)))


def _bend(corner: Floats, back: Floats, onward: Floats) -> Floats:
    """(n, 2) points of the parabola; ``back`` and ``onward`` are relative to the corner."""
    count = max(3, round(float(np.hypot(*back) + np.hypot(*onward)) / _STEP_M) + 1)
    t = np.linspace(0.0, 1.0, count)[:, None]
    return corner + (1.0 - t) ** 2 * back + t**2 * onward


def _with_even_points(points: Floats) -> Floats:
    """Insert points into (n, 2) so that none are over a centimetre apart."""
    gap = np.hypot(*np.diff(points, axis=0).T)
    count = np.where(gap < 1e-9, 0, np.ceil(gap / _STEP_M - 1e-6).clip(1.0)).astype(int)
    piece = np.repeat(np.arange(len(gap)), count)
    step = np.arange(1, len(piece) + 1) - np.repeat(np.cumsum(count) - count, count)
    part = (step / count[piece])[:, None]
    between = points[piece] + part * (points[piece + 1] - points[piece])
    return np.ascontiguousarray(np.vstack([points[:1], between]))
