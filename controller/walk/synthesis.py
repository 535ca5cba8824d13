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
from numpy.typing import NDArray

from snakewalk.config.arrays import Complexes, Floats
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.walk.angle_track import AngleTrack

Schedule = float | Callable[[int], float | Floats]
"""A constant, or a function of the frame that gives a scalar or a value per point (N,)."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """How the angles move along the body.

    Raises:
        ValueError: a constant sliding outside 0..1.

    """

    sliding: Schedule = 0.0
    """w_d in 0..1: share of the pulse that is lost. At 1 the shape is frozen and glides."""
    pulse_m_s: Schedule = 0.0
    """g of Eq. 13, added to the speed of the body."""

    def __post_init__(self) -> None:
        if isinstance(self.sliding, float | int) and not 0.0 <= self.sliding <= 1.0:
            raise ValueError(f"sliding {self.sliding}: expected 0 to 1")


def at_frame(schedule: Schedule, frame: int) -> Floats:
    """Value of a schedule at a frame, () or (N,)."""
    return np.asarray(schedule(frame) if callable(schedule) else schedule, dtype=float)


def waves_mask(states: Complexes, waves: slice, share: float) -> NDArray[np.bool_]:
    """Choose states (S, n) by their waves, as Fig. 13 does: which of them are curved so.

    Args:
        states: coefficients 1..n; scaling them by a factor scales every bend (curvature).
        waves: which coefficients, 0 for the lowest frequency.
        share: least share of the state's energy that these must hold.

    """
    energy = np.abs(states) ** 2
    return np.asarray(energy[:, waves].sum(axis=1) >= share * energy.sum(axis=1))


def varied_pulse(
    points: int,
    frames: int,
    parts: int,
    spread_m_s: float,
    step_m_s: float,
    rng: np.random.Generator,
) -> Floats:
    """Draw g (frames, points) as [PT] 2.6.4 found it: constant on parts, steps below a limit.

    Each of ``parts`` equal parts starts within ``spread_m_s`` of 0 and wanders by less than
    ``step_m_s`` a frame; neighbouring parts never differ by as much as that.
    """
    values = np.empty((frames, parts))
    now = np.cumsum(rng.uniform(-1.0, 1.0, parts) * 0.99 * step_m_s)
    now = np.clip(now, -spread_m_s, spread_m_s)
    for frame in range(frames):
        values[frame] = now
        target = np.clip(
            now + rng.uniform(-1.0, 1.0, parts) * 0.49 * step_m_s, -spread_m_s, spread_m_s
        )
        for part in range(1, parts):  # from the head on, as neighbours bound each other
            room = 0.99 * step_m_s
            target[part] = np.clip(target[part], target[part - 1] - room, target[part - 1] + room)
        now = now + np.clip(target - now, -0.99 * step_m_s, 0.99 * step_m_s)
    return np.repeat(values, np.diff(np.linspace(0, points, parts + 1).astype(int)), axis=1)


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
    direction = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)
    points = np.zeros((*angles_rad.shape[:1], angles_rad.shape[1] + 1, 2))
    points[:, 1:] = -segment_m * np.cumsum(direction, axis=1)
    moved = direction[:, 0] * (speed_m_s * dt_s)[:, None]
    moved[0] = head_m
    points += np.cumsum(moved, axis=0)[:, None]
    return points
