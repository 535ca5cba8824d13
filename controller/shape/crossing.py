"""Whether a body touches itself: a thick curve against its own other parts."""

from functools import cache

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices

_AT_ONCE = 256  # bodies in memory
_GROUP = 4  # segments


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
    touches = np.zeros(len(shapes), dtype=bool)
    if lag >= points:
        return touches
    reach = 2.0 * radius_m + piece  # segments this far apart at their middles cannot touch
    for first in range(0, len(shapes), _AT_ONCE):
        some = shapes[first : first + _AT_ONCE]
        step = np.stack([np.cos(some), np.sin(some)], axis=-1) * piece
        ends = np.concatenate([np.zeros((len(some), 1, 2)), np.cumsum(step, axis=1)], axis=1)
        body, i, j = _near_pairs(ends, lag, reach, piece)
        if not len(body):  # the usual case
            continue
        a, b, c, d = ends[body, i], ends[body, i + 1], ends[body, j], ends[body, j + 1]
        near = _segments_cross(a, b, c, d)
        for point, start, stop in ((a, c, d), (b, c, d), (c, a, b), (d, a, b)):
            near |= _distance(point, start, stop) < 2.0 * radius_m
        touches[first + body[near]] = True
    return touches


def _near_pairs(
    ends: Floats, lag: int, reach_m: float, piece_m: float
) -> tuple[Indices, Indices, Indices]:
    """Body, first and second segment of all pairs ``lag`` apart whose middles are within reach.

    Looked for between groups of segments first: a middle is at most 1.5 pieces from its group's.
    """
    points = ends.shape[1] - 1
    group_i, group_j, part_i, part_j = _groups(points, lag)
    last = (points - 1) // _GROUP
    centres = ends[:, np.minimum(np.arange(last + 1) * _GROUP + 2, points)]
    gap = centres[:, group_i] - centres[:, group_j]
    far = reach_m + 3.0 * piece_m
    body, pair = np.nonzero(gap[..., 0] ** 2 + gap[..., 1] ** 2 < far**2)
    i = (group_i[pair][:, None] * _GROUP + part_i).ravel()
    j = (group_j[pair][:, None] * _GROUP + part_j).ravel()
    real = (j - i >= lag) & (j < points)
    body, i, j = body.repeat(len(part_i))[real], i[real], j[real]
    middle = 0.5 * (ends[:, 1:] + ends[:, :-1])
    gap = middle[body, i] - middle[body, j]
    near = gap[:, 0] ** 2 + gap[:, 1] ** 2 < reach_m**2
    return body[near], i[near], j[near]


@cache
def _groups(points: int, lag: int) -> tuple[Indices, Indices, Indices, Indices]:
    """Pairs of groups with segments ``lag`` apart, and of the segments in them."""
    count = (points - 1) // _GROUP + 1
    apart = max(0, -(-(lag - _GROUP + 1) // _GROUP))
    parts = np.divmod(np.arange(_GROUP * _GROUP), _GROUP)
    made = (*np.triu_indices(count, apart), *parts)
    for each in made:
        each.setflags(write=False)
    return made


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
