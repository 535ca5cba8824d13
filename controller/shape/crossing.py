"""Whether a body touches itself: a thick curve against its own other parts."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
_AT_ONCE = 256  # bodies in memory: 256 x 5000 pairs of segments


def self_touches(skeleton_rad: Floats, length_m: float, radius_m: float) -> Bools:
    """Whether each body (S, N) of ``length_m`` and ``radius_m`` comes within its own thickness.

    Two segments count when they are nearer than a diameter in the plane though at least half the
    circumference of the body apart along it: nearer ones are joined by the bend itself, and a curve
    that bends no sharper than ``radius_m`` keeps such parts a diameter apart (Schur). Crossings of
    a thin body count too. Returns (S,).
    """
    shapes = np.atleast_2d(skeleton_rad)
    points = shapes.shape[1]
    piece = length_m / points
    lag = max(2, int(np.ceil(np.pi * radius_m / piece)) + 1)  # segment ends are then pi r apart
    i, j = _pairs(points, lag)
    if len(i) == 0:
        return np.zeros(len(shapes), dtype=bool)
    touches = np.zeros(len(shapes), dtype=bool)
    for first in range(0, len(shapes), _AT_ONCE):
        some = shapes[first : first + _AT_ONCE]
        step = np.stack([np.cos(some), np.sin(some)], axis=-1) * piece
        ends = np.concatenate([np.zeros((len(some), 1, 2)), np.cumsum(step, axis=1)], axis=1)
        middle = 0.5 * (ends[:, 1:] + ends[:, :-1])
        gap = middle[:, i] - middle[:, j]
        reach = 2.0 * radius_m + piece  # segments this far apart at their middles cannot touch
        body, pair = np.nonzero(gap[..., 0] ** 2 + gap[..., 1] ** 2 < reach**2)
        a, b = ends[body, i[pair]], ends[body, i[pair] + 1]
        c, d = ends[body, j[pair]], ends[body, j[pair] + 1]
        near = _segments_cross(a, b, c, d)
        for point, start, stop in ((a, c, d), (b, c, d), (c, a, b), (d, a, b)):
            near |= _distance(point, start, stop) < 2.0 * radius_m
        touches[first + body[near]] = True
    return touches


@cache
def _pairs(points: int, lag: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of segments at least ``lag`` apart, first and second; asked anew in every decision."""
    first, second = np.triu_indices(points, lag)
    first.setflags(write=False)
    second.setflags(write=False)
    return first, second


def _distance(point: Floats, start: Floats, stop: Floats) -> Floats:
    """From points (K, 2) to segments."""
    along = stop - start
    part = np.einsum("ij,ij->i", point - start, along) / np.einsum("ij,ij->i", along, along)
    nearest = start + np.clip(part, 0.0, 1.0)[:, None] * along
    return np.asarray(np.hypot(*(point - nearest).T))


def _segments_cross(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Whether segments ab and cd (K, 2 each) cross properly."""
    return np.asarray(
        (_side(a, b, c) * _side(a, b, d) < 0.0) & (_side(c, d, a) * _side(c, d, b) < 0.0)
    )


def _side(a: Floats, b: Floats, p: Floats) -> Floats:
    u, v = b - a, p - a
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
