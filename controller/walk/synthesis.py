"""Skeleton angles and points over time ([PT] 2.6.4, Eq. 8-13).

``Theta(n, t)`` moves along the body at ``u = |v| + g(n, t)`` and slides with weight ``w_d(n, t)``.
Corrections: the angle track stays untouched and each point keeps its *place* on it, as looking up
fractions of a point again and again (Eq. 10-12 as printed) blurs the angles; places change by the
shift less the share w_d of it, which is what Eq. 12 does with a forward difference; the base is
added once; the head moves along the new ``Theta(1, t)``; a track that runs out grows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.behaviour import Behaviour, at_frame

Grow = Callable[[AngleTrack], object]
"""Appends the next state to the track, for example by ``Walker.decide``."""


@dataclass(frozen=True, slots=True)
class Locomotion:
    """A sequence of frames in plan, head first."""

    angles_rad: Floats
    """(T, N) tangent angles."""
    points_m: Floats
    """(T, N + 1, 2) points; point 0 is the head's tip."""
    speed_m_s: Floats
    """(T,) speed of the head along its tangent."""
    place: Floats
    """(T, N) sample of the track that each point shows."""


def synthesise(
    track: AngleTrack,
    law: SpeedLaw,
    frames: int,
    dt_s: float,
    segment_m: float,
    grow: Grow | None = None,
    behaviour: Behaviour | None = None,
    head_m: tuple[float, float] = (0.0, 0.0),
    speed_m_s: float = 0.0,
) -> Locomotion:
    """Run ``frames`` frames, the first of which is the body that the track starts with.

    Args:
        track: holds at least the first body; it is extended by ``grow`` when it runs out.
        law: the speed, from the bends and the turning of the frame before.
        frames: T.
        dt_s: time between frames.
        segment_m: r, the body's length over N.
        grow: appends to the track.
        behaviour: sliding and pulse speed; default neither.
        head_m: where the head's tip starts.
        speed_m_s: v of the first frame.

    Raises:
        ValueError: the track ran out and nothing makes it longer; or the time step is unstable.

    """
    how = behaviour or Behaviour()
    n = np.arange(track.points, dtype=float)
    ahead = np.full(track.points, float(track.points))  # place + n + 1: constant if nothing slides
    angles, place = np.empty((frames, len(n))), np.empty((frames, len(n)))
    speed = np.empty(frames)
    place[0], angles[0], speed[0] = ahead - n - 1, track.body_rad(track.points), speed_m_s
    turn = 0.0
    for t in range(1, frames):
        before = angles[t - 1]
        speed[t] = law.step_m_s(float(speed[t - 1]), float(before.std()), turn, dt_s)
        pulse = np.maximum(speed[t] + at_frame(how.pulse_m_s, t), 0.0) * dt_s / segment_m
        shift = np.broadcast_to(pulse * (1.0 - at_frame(how.sliding, t)), n.shape)
        # a point shows what the point ``shift`` before it showed: places are looked up, not angles
        ahead = np.interp(n - shift, n, ahead) + shift
        place[t] = ahead - n - 1
        _serve(track, float(place[t].max()), grow)
        angles[t] = track.at_rad(place[t])
        turn = float(angles[t].mean() - before.mean()) / dt_s
    return Locomotion(angles, _points(angles, speed, dt_s, segment_m, head_m), speed, place)


def _serve(track: AngleTrack, place: float, grow: Grow | None) -> None:
    while place > track.end - 1:
        had = track.end
        if grow is not None:
            grow(track)
        if track.end == had:
            raise ValueError(f"the track ends at sample {had - 1} and the head is at {place:.1f}")


def _points(
    angles_rad: Floats,
    speed_m_s: Floats,
    dt_s: float,
    segment_m: float,
    head_m: tuple[float, float],
) -> Floats:
    """(T, N + 1, 2): ``P(0)`` is the head, ``P(n) = P(n - 1) - r [cos Theta, sin Theta]``."""
    way = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)
    points = np.zeros((*angles_rad.shape[:1], angles_rad.shape[1] + 1, 2))
    points[:, 1:] = -segment_m * np.cumsum(way, axis=1)
    moved = way[:, 0] * (speed_m_s * dt_s)[:, None]
    moved[0] = head_m
    points += np.cumsum(moved, axis=0)[:, None]
    return points
