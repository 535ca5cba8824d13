"""A composed motion that passes its control points exactly ([TH] 5).

Segments of a film have one length and one turn each, so that a sequence of them seldom passes
through a control point. Here the way from one point to the next is bent: each place is shifted by a
share of the missing distance. The share grows along the distance swum by a quintic. Where the fish
rests nothing moves. Head and pitch turn with the way, and keep their values at the points.
"""

from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.kinematics.smoothstep import quintic

_SEARCH_S = 0.4
"""Time before and after the moment of the search in which the nearest place is looked for."""


@dataclass(frozen=True, slots=True)
class Steered:
    """A motion through its points."""

    motion: Postures
    reached_at: tuple[int, ...]
    """Frame at which each point is passed."""
    distance: Floats
    """(n,) distance from each point there, in the recording's unit."""
    turn_rad: float
    """Largest change of the direction of the way."""


def steered(
    motion: Postures, points: Floats, reached_at: tuple[int, ...], radius: float
) -> Steered:
    """Bend the ways between control points so that each is passed within ``radius``.

    Args:
        motion: of the pieces.
        points: (n, 2) or with heights (n, 3).
        reached_at: frame of the motion near each point, increasing.
        radius: a point that is passed nearer than this by itself is left as it is.

    """
    place = _place(motion, points.shape[1])
    head = motion.head_rad.copy()
    pitch = np.zeros(motion.frames)
    samples = round(_SEARCH_S * motion.rate_hz)
    begin = 0
    frame_indices = []
    turned = 0.0
    for number, (point, guess) in enumerate(zip(points, reached_at, strict=True), 1):
        # each later point needs a later frame
        end = min(guess + samples + 1, motion.frames - (len(points) - number))
        window = np.arange(min(max(begin + 1, guess - samples), end - 1), end)
        frame = int(window[np.argmin(np.linalg.norm(place[window] - point, axis=1))])
        missing = point - place[frame]
        if np.linalg.norm(missing) > radius:
            turn, rise = _bend(place, begin, frame, missing)
            head[begin : frame + 1] += turn
            pitch[begin : frame + 1] += rise
            turned = max(turned, float(np.abs(turn).max()), float(np.abs(rise).max()))
        frame_indices.append(frame)
        begin = frame
    moved = replace(motion, base=place[:, :2], head_rad=head)
    if points.shape[1] == 3 and motion.pitch_rad is not None:
        moved = replace(moved, height=place[:, 2], pitch_rad=motion.pitch_rad + pitch)
    distance = np.linalg.norm(place[frame_indices] - points, axis=1)
    return Steered(moved, tuple(frame_indices), distance, turned)


def _place(motion: Postures, dimensions: int) -> Floats:
    """(T, 2) or (T, 3) base of the head."""
    if dimensions == 3 and motion.height is not None:
        return np.column_stack([motion.base, motion.height])
    return motion.base.copy()


def _bend(place: Floats, begin: int, end: int, missing: Floats) -> tuple[Floats, Floats]:
    """Shift places from ``begin`` on, in place; returns turns of head and pitch up to ``end``."""
    far = arc_lengths(place[begin : end + 1, :2])
    share = far / max(far[-1], 1e-12)
    grown = quintic(share)
    before = place[begin : end + 1].copy()
    place[begin : end + 1] += grown[:, None] * missing
    place[end + 1 :] += missing
    slope = 30.0 * share**2 * (1.0 - share) ** 2 / max(far[-1], 1e-12)
    direction = np.gradient(before, axis=0) if len(before) > 1 else np.zeros_like(before)
    pace = np.maximum(np.hypot(direction[:, 0], direction[:, 1]), 1e-12)
    old = direction[:, :2] / pace[:, None]
    new = old + slope[:, None] * missing[:2]
    cross = old[:, 0] * new[:, 1] - old[:, 1] * new[:, 0]
    turn = np.where(pace > 1e-9, np.arctan2(cross, (old * new).sum(axis=1)), 0.0)
    rise = np.arctan(slope * missing[2]) if len(missing) == 3 else np.zeros(len(before))
    return turn, rise
