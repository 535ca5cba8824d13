"""Test whether a body, as a thick curve, touches itself."""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled


def self_touches(skeleton_rad: Floats, length_m: float, radius_m: float) -> Bools:
    """Return (S,) whether each body (S, N) of ``length_m`` and ``radius_m`` touches itself.

    Two segments touch if they cross or are nearer than a diameter, and are at least pi radii apart
    along the body. Nearer segments of a curve that bends no sharper than ``radius_m`` are a
    diameter apart (Schur).
    """
    shapes = np.atleast_2d(skeleton_rad)
    points = shapes.shape[1]
    piece = length_m / points
    lag = max(2, int(np.ceil(np.pi * radius_m / piece)) + 1)  # segment ends are then pi r apart
    touches = np.zeros(len(shapes), dtype=bool)
    if lag >= points:
        return touches
    _find(np.ascontiguousarray(shapes, dtype=float), piece, lag, 2.0 * radius_m, touches)
    return touches


@compiled("float64(float64[::1], float64[::1], int64, int64)")
def _square_m2(x: Floats, y: Floats, point: int, segment: int) -> float:
    u, v = x[segment + 1] - x[segment], y[segment + 1] - y[segment]
    dx, dy = x[point] - x[segment], y[point] - y[segment]
    part = min(max((dx * u + dy * v) / (u * u + v * v), 0.0), 1.0)
    dx, dy = dx - part * u, dy - part * v
    return float(dx * dx + dy * dy)


@compiled("float64(float64[::1], float64[::1], int64, int64)")
def _side(x: Floats, y: Floats, segment: int, point: int) -> float:
    """Positive if the point lies left of the segment's line, 0 if it lies on the line."""
    u, v = x[segment + 1] - x[segment], y[segment + 1] - y[segment]
    return float(u * (y[point] - y[segment]) - v * (x[point] - x[segment]))


@compiled("boolean(float64[::1], float64[::1], int64, int64, float64)")
def _segments_are_near(x: Floats, y: Floats, i: int, j: int, width_m: float) -> bool:
    """Whether the segments are nearer than ``width_m`` or cross."""
    crosses = (
        _side(x, y, i, j) * _side(x, y, i, j + 1) < 0.0
        and _side(x, y, j, i) * _side(x, y, j, i + 1) < 0.0
    )
    square = min(_square_m2(x, y, i, j), _square_m2(x, y, i + 1, j))
    square = min(square, _square_m2(x, y, j, i))
    square = min(square, _square_m2(x, y, j + 1, i))
    return crosses or square < width_m * width_m


@compiled("boolean(float64[::1], float64[::1], int64, float64, float64)")
def _touches(x: Floats, y: Floats, lag: int, width_m: float, piece_m: float) -> bool:
    points = len(x) - 1
    reach_m = width_m + piece_m  # largest distance of middles that touch
    for i in range(points - lag):
        j = i + lag
        while j < points:
            gap_x, gap_y = x[i] + x[i + 1] - x[j] - x[j + 1], y[i] + y[i + 1] - y[j] - y[j + 1]
            square = 0.25 * (gap_x * gap_x + gap_y * gap_y)
            if square < reach_m * reach_m and _segments_are_near(x, y, i, j, width_m):
                return True
            # one step brings the middles nearer by at most a segment's length
            j += max(1, int((np.sqrt(square) - reach_m) / piece_m))
    return False


@compiled("void(float64[:, ::1], float64, int64, float64, boolean[::1])")
def _find(shapes_rad: Floats, piece_m: float, lag: int, width_m: float, touches: Bools) -> None:
    """Write to ``touches`` whether segments ``lag`` or more apart touch, for bodies (S, N)."""
    points = shapes_rad.shape[1]
    x, y = np.empty(points + 1), np.empty(points + 1)
    for body in range(len(shapes_rad)):
        x[0] = y[0] = 0.0
        for k in range(points):
            x[k + 1] = x[k] + piece_m * np.cos(shapes_rad[body, k])
            y[k + 1] = y[k] + piece_m * np.sin(shapes_rad[body, k])
        touches[body] = _touches(x, y, lag, width_m, piece_m)
