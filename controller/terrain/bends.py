"""Widen the bends of a path for a body that cannot follow sharp corners."""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath

_CHORD_M = 0.05  # the path is tabulated every centimetre: a shorter arc has no curvature
_WORTH = 1.1  # a change must widen the sharpest bend by this much
_CHANGES = 8
_NEAREST_COUNT = 2
_SPLINE_UNITS = 500
"""Work of a spline, of its bends, or of its check."""


def widen_in_steps(
    points_m: Floats, free: Bools, radius_m: float, safe: Callable[[SplinePath], bool]
) -> Steps[SplinePath]:
    """Spline through points; free points near sharp bends are dropped or pulled straight.

    Ends when every bend has ``radius_m``, or when no change that keeps the path safe helps. The
    other points stay.
    """
    yield _SPLINE_UNITS
    path = SplinePath(points_m)
    for _ in range(_CHANGES):
        yield _SPLINE_UNITS
        radius, at_m = sharpest_bend(path)
        if radius >= radius_m:
            break
        best = None
        for k in _nearest_free(points_m, free, at_m):
            straight = points_m.copy()
            straight[k] = (points_m[k - 1] + 2.0 * points_m[k] + points_m[k + 1]) / 4.0
            dropped = np.delete(points_m, k, axis=0), np.delete(free, k)
            for points, still_free in (dropped, (straight, free)):
                yield _SPLINE_UNITS
                changed = SplinePath(points)
                yield _SPLINE_UNITS
                wider = sharpest_bend(changed)[0]
                if wider <= _WORTH * (radius if best is None else best[0]):
                    continue
                yield _SPLINE_UNITS
                if safe(changed):
                    best = wider, points, still_free, changed
        if best is None:
            break
        _, points_m, free, path = best
    return path


def sharpest_bend(path: SplinePath) -> tuple[float, Floats]:
    """Return the smallest radius of curvature (infinite on a straight path) and its point.

    The radius comes from three points of the path, five centimetres apart.
    """
    count = max(1, int(path.length_m / 0.02))
    s = np.linspace(_CHORD_M, max(_CHORD_M, path.length_m - _CHORD_M), count)
    a, b, c = (path.position(s + step) for step in (-_CHORD_M, 0.0, _CHORD_M))
    (ux, uy), (vx, vy) = (b - a).T, (c - b).T
    turn = np.abs(np.arctan2(ux * vy - uy * vx, ux * vx + uy * vy))
    k = int(np.argmax(turn))
    return (_CHORD_M / float(turn[k]) if turn[k] > 1e-6 else float("inf")), b[k]


def _nearest_free(points: Floats, free: Bools, at_m: Floats) -> list[int]:
    which = np.flatnonzero(free)
    order = np.argsort(np.hypot(*(points[which] - at_m).T))
    return [int(k) for k in which[order[:_NEAREST_COUNT]]]
