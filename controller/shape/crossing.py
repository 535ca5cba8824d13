"""Whether a body touches itself: a thick curve against its own other parts."""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled


def self_touches(skeleton_rad: Floats, length_m: float, radius_m: float) -> Bools:
    """Whether each body (S, N) of ``length_m`` and ``radius_m`` comes within its own thickness.

    Two segments count when they are nearer than a diameter in the plane though at least half the
    circumference of the body apart along it. Nearer ones are joined by the bend itself, and a curve
    that bends no sharper than ``radius_m`` keeps such parts a diameter apart (Schur). Crossings of
    a thin body count too. Returns (S,).
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
    """Square of the distance of a point of the curve from a segment."""
    u, v = x[segment + 1] - x[segment], y[segment + 1] - y[segment]
    dx, dy = x[point] - x[segment], y[point] - y[segment]
    part = min(max((dx * u + dy * v) / (u * u + v * v), 0.0), 1.0)
    dx, dy = dx - part * u, dy - part * v
    return float(dx * dx + dy * dy)


@compiled("float64(float64[::1], float64[::1], int64, int64)")
def _side(x: Floats, y: Floats, segment: int, point: int) -> float:
    """On which side of a segment's line a point of the curve lies; 0 is on it."""
    u, v = x[segment + 1] - x[segment], y[segment + 1] - y[segment]
    return float(u * (y[point] - y[segment]) - v * (x[point] - x[segment]))


@compiled("boolean(float64[::1], float64[::1], int64, int64, float64)")
def _is_near(x: Floats, y: Floats, i: int, j: int, width_m: float) -> bool:
    """Whether segments ``i`` and ``j`` of a curve are nearer than ``width_m``, or cross."""
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
    """Whether a curve's segments touch, which are ``piece_m`` long."""
    points, reach_m = len(x) - 1, width_m + piece_m  # of middles that may belong to a touch
    for i in range(points - lag):
        j = i + lag
        while j < points:
            gap_x, gap_y = x[i] + x[i + 1] - x[j] - x[j + 1], y[i] + y[i + 1] - y[j] - y[j + 1]
            square = 0.25 * (gap_x * gap_x + gap_y * gap_y)
            if square < reach_m * reach_m and _is_near(x, y, i, j, width_m):
                return True
            # a step brings the middles nearer by a segment's length at most
            j += max(1, int((np.sqrt(square) - reach_m) / piece_m))
    return False


@compiled("void(float64[:, ::1], float64, int64, float64, boolean[::1])")
def _find(shapes_rad: Floats, piece_m: float, lag: int, width_m: float, touches: Bools) -> None:
    """Note of each body (S, N) whether two segments ``lag`` apart are nearer than ``width_m``."""
    points = shapes_rad.shape[1]
    x, y = np.empty(points + 1), np.empty(points + 1)
    for body in range(len(shapes_rad)):
        x[0] = y[0] = 0.0
        for k in range(points):
            x[k + 1] = x[k] + piece_m * np.cos(shapes_rad[body, k])
            y[k + 1] = y[k] + piece_m * np.sin(shapes_rad[body, k])
        touches[body] = _touches(x, y, lag, width_m, piece_m)
