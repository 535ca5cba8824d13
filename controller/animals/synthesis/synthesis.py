"""Skeleton angles and points over time ([PT] 2.6.4, Eq. 8-13).

``Theta(n, t)`` moves along the body at ``u = |v| + g(n, t)`` and slides with weight ``w_d(n, t)``.
Corrections: each point keeps its *place* on an unchanged angle track; looking up fractions of a
point again and again (Eq. 10-12 as printed) blurs the angles. Places change by the shift less the
share w_d of it, which equals Eq. 12 with a forward difference. The base is added once, and the head
moves along the new ``Theta(1, t)``. A track that runs out grows.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, hypot, sin, sqrt
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics import smoothstep
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.drivers.compiling import compiled, readonly_array

Schedule = float | Callable[[int], float | Floats]
"""A constant, or a function of the frame that gives a scalar or a value per point (N,)."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """How the angles move along the body, and how its ends are held.

    Raises:
        ValueError: a constant sliding outside 0..1.

    """

    sliding: Schedule = 0.0
    """w_d in 0..1: share of the pulse that is lost. At 1 the shape is frozen."""
    pulse_m_s: Schedule = 0.0
    """Pulse speed g of Eq. 13, added to the speed of the body."""
    head_held: Schedule = 0.0
    """Share of the body's mean heading in the head and neck, 0 to 1 (ours)."""
    calm_tail: Schedule = 0.0
    """Share by which the bends of the tail are flattened, 0 to 1 (ours)."""

    def __post_init__(self) -> None:
        if isinstance(self.sliding, float | int) and not 0.0 <= self.sliding <= 1.0:
            raise ValueError(f"sliding {self.sliding}: expected 0 to 1")


NECK = 0.2
HIPS = 0.6
"""End of a held head, and start of a calm tail, along the body (ours)."""


def at_frame(schedule: Schedule, frame: int) -> Floats:
    """Value of a schedule at a frame, () or (N,)."""
    return np.asarray(schedule(frame) if callable(schedule) else schedule, dtype=float)


def varied_pulse(
    points: int,
    frames: int,
    parts: int,
    spread_m_s: float,
    step_m_s: float,
    rng: np.random.Generator,
) -> Floats:
    """Draw g (frames, points) as [PT] 2.6.4 found it: constant on parts, steps below a limit.

    Each of ``parts`` equal parts starts within ``spread_m_s`` of 0. It changes by less than
    ``step_m_s`` a frame, and neighbouring parts differ by less than that.
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


Grow = Callable[[AngleTrack, Floats], object]
"""Appends the next state to the track, from the track and the body's points (N + 1, 2)."""
Until = Callable[[int, Floats], bool]
"""Returns whether the motion ends with a frame, from its number and points."""


@dataclass(frozen=True, slots=True)
class Locomotion:
    """A sequence of frames in plan, head first."""

    angles_rad: Floats
    """(T, N) tangent angles."""
    points_m: Floats
    """(T, N + 1, 2) points; point 0 is the head's tip."""
    speed_m_s: Floats
    """(T,) speed of the first point that follows the track (n_0): along its tangent."""
    place: Floats
    """(T, N) sample of the track that each point shows."""


class Sampling(NamedTuple):
    """Steps of a synthesis in time and along the body."""

    dt_s: float
    """Time between frames."""
    segment_m: float
    """Length r of a segment: the body's length over N."""


@dataclass(frozen=True, slots=True)
class Start:
    """Pose and speed in the first frame."""

    head_m: tuple[float, float] = (0.0, 0.0)
    """Position of the head's tip."""
    heading_rad: float = 0.0
    """Rotation from the track's angles to the world."""
    speed_m_s: float = 0.0
    """Speed v of the body."""


def synthesise(
    track: AngleTrack,
    law: SpeedLaw,
    frames: int,
    sampling: Sampling,
    grow: Grow | None = None,
    behaviour: Behaviour | None = None,
    start: Start = Start(),
    until: Until | None = None,
) -> Locomotion:
    """Run ``frames`` frames; the first is the body at the start of the track.

    Args:
        track: contains at least the first body; ``grow`` extends it.
        law: speed from the bends and the turning of the frame before.
        frames: T, or the largest T.
        sampling: time between frames, and length of a segment.
        grow: appends to the track.
        behaviour: sliding, pulse speed and held ends; default none of it.
        start: pose and speed of the first frame.
        until: ends the motion early.

    Raises:
        ValueError: the track ran out without ``grow``, or the time step is unstable.

    """
    dt_s, segment_m = sampling
    heading_rad = start.heading_rad
    how = behaviour or Behaviour()
    n = np.arange(track.points, dtype=float)
    ahead = np.full(track.points, float(track.points))  # place + n + 1: constant if nothing slides
    angles = np.empty((frames, len(n)))
    place = np.empty((frames, len(n)))
    points = np.empty((frames, len(n) + 1, 2))
    speed = np.empty(frames)
    place[0], speed[0] = ahead - n - 1, start.speed_m_s
    angles[0], _ = _posture(track.body_rad(track.points) + heading_rad, how, 0)
    points[0] = chain(angles[0], segment_m) + start.head_m
    turn = 0.0
    last = frames - 1
    mean, bend = _moments(angles[0])
    for t in range(1, frames):
        if until is not None and until(t - 1, points[t - 1]):
            last = t - 1
            break
        speed[t] = law.step_m_s(float(speed[t - 1]), bend, turn, dt_s)
        pulse = np.maximum(speed[t] + at_frame(how.pulse_m_s, t), 0.0) * dt_s / segment_m
        shift = np.broadcast_to(pulse * (1.0 - at_frame(how.sliding, t)), n.shape)
        ahead = _shifted_places(ahead, shift)
        np.subtract(ahead, n + 1.0, out=place[t])
        _serve(track, float(place[t].max()), grow, points[t - 1])
        angles[t], leader = _posture(track.at_rad(place[t]) + heading_rad, how, t)
        was, (mean, bend) = mean, _moments(angles[t])
        turn = (mean - was) / dt_s
        shape = chain(angles[t], segment_m)
        step = speed[t] * dt_s
        along = step * np.array([cos(angles[t, leader]), sin(angles[t, leader])])
        points[t] = shape + (points[t - 1, leader] + along - shape[leader])
    used_frames = slice(0, last + 1)
    return Locomotion(
        angles[used_frames], points[used_frames], speed[used_frames], place[used_frames]
    )


def _posture(angles_rad: Floats, how: Behaviour, frame: int) -> tuple[Floats, int]:
    """Angles with fixed ends, and n_0: the first point that follows the track freely.

    [PT] 2.6.3 lets n_0 change over time. Behind a held head the neck leads.
    """
    held_share = float(at_frame(how.head_held, frame))
    calm = float(at_frame(how.calm_tail, frame))
    if held_share == 0.0 and calm == 0.0:
        return angles_rad, 0
    s = np.linspace(0.0, 1.0, len(angles_rad))
    head = 1.0 - smoothstep.cubic(np.clip(s / NECK, 0.0, 1.0))
    tail = smoothstep.cubic(np.clip((s - HIPS) / (1.0 - HIPS), 0.0, 1.0))
    mean = angles_rad.mean()
    kept = (1.0 - held_share * head) * (1.0 - calm * tail)
    leader = int(np.argmax(head == 0.0)) if held_share > 0.0 else 0
    return mean + kept * (angles_rad - mean), leader


def _serve(track: AngleTrack, place: float, grow: Grow | None, points_m: Floats) -> None:
    while place > track.end - 1:
        track_end = track.end
        if grow is not None:
            grow(track, points_m)
        if track.end == track_end:
            raise ValueError(
                f"the track ends at sample {track_end - 1} and the head is at {place:.1f}"
            )


_VALUES = readonly_array()


@compiled(f"float64[::1]({_VALUES}, {_VALUES})")
def _shifted_places(ahead: Floats, shift: Floats) -> Floats:
    """Places ahead (N,) after a shift: a point shows what the point ``shift`` before it showed.

    A constant stays one, bit for bit.
    """
    moved = np.empty(len(ahead))
    for n in range(len(ahead)):
        source_frame = min(max(n - shift[n], 0.0), len(ahead) - 1.0)
        k = min(int(source_frame), len(ahead) - 2)
        moved[n] = ahead[k] + (source_frame - k) * (ahead[k + 1] - ahead[k]) + shift[n]
    return moved


@compiled(f"UniTuple(float64, 2)({_VALUES})")
def _moments(angles_rad: Floats) -> tuple[float, float]:
    """Mean, and standard deviation K, of (N,) angles."""
    mean = 0.0
    square = 0.0
    for angle in angles_rad:
        mean += angle
    mean /= len(angles_rad)
    for angle in angles_rad:
        square += (angle - mean) ** 2
    return mean, sqrt(square / len(angles_rad))


@compiled(f"float64[:, ::1]({_VALUES}, float64)")
def chain(angles_rad: Floats, segment_m: float) -> Floats:
    """(N + 1, 2): ``P(0)`` is the origin, ``P(n) = P(n - 1) - r [cos Theta, sin Theta]``."""
    points = np.zeros((len(angles_rad) + 1, 2))
    for n in range(len(angles_rad)):
        points[n + 1, 0] = points[n, 0] - segment_m * cos(angles_rad[n])
        points[n + 1, 1] = points[n, 1] - segment_m * sin(angles_rad[n])
    return points


_PATH_POINTS = 200
Replan = Callable[[Floats, float], SplinePath]
"""Plans from the head and the remaining waypoints (W + 1, 2), and the body's heading."""


class Targets:
    """The targets T_n of a motion, in order ([PT] 2.6, Algorithm 2).

    They are the waypoints, and points of the planned path evenly between them. Corrections: the
    loop ends when the last of L targets is reached, where the text prints ``until n < N``. A target
    between waypoints also counts as reached when the body has passed it by within twice the radius,
    or reached the next one.
    """

    def __init__(
        self,
        path: SplinePath,
        waypoints_m: Floats,
        radius_m: float,
        spacing_m: float,
        carrot_m: float = 0.6,
        replan: Replan | None = None,
    ) -> None:
        self.radius_m, self._carrot_m, self._spacing_m = radius_m, carrot_m, spacing_m
        self._waypoints_m = waypoints_m
        self._replan = replan
        self.points_m = np.empty((0, 2))
        """(L, 2); after a miss, the reached ones and those of the new path."""
        self.required = np.empty(0, dtype=bool)
        """(L,) whether each control point is a waypoint."""
        self._marks_m: list[float] = []
        self._ahead: list[tuple[float, float]] = []
        self._planned: list[tuple[int, SplinePath]] = []
        self.current: list[int] = []
        """Number n of the current control point at each frame."""
        self._extend(path, waypoints_m)
        self.index = 0
        """Number n of the current control point, from 0; L when all are reached."""
        self.missed = 0
        """Number of waypoints passed by, after which a new path was planned."""
        self.distance_m: list[float] = []
        """Distance D_n to the next target at each frame."""

    def _extend(self, path: SplinePath, waypoints_m: Floats) -> None:
        """Go on along a path through waypoints (W, 2)."""
        self.path = path
        self._head_s_m = 0.0
        at_s_m = 0.0
        self._planned.append((len(self.current), path))
        for waypoint in waypoints_m:
            to_s_m = max(path.first_pass(waypoint, at_s_m), at_s_m)
            pieces = max(1, int(np.ceil((to_s_m - at_s_m) / self._spacing_m - 1e-9)))
            s_m = np.linspace(at_s_m, to_s_m, pieces + 1)[1:]
            self.points_m = np.vstack([self.points_m, path.position(s_m[:-1]), waypoint])
            self._marks_m += s_m.tolist()
            headings_rad = [path.heading_rad(s) for s in s_m.tolist()]
            self._ahead += [(cos(heading), sin(heading)) for heading in headings_rad]
            self.required = np.append(self.required, [False] * (pieces - 1) + [True])
            at_s_m = to_s_m

    def paths(self, rate_hz: float) -> list[tuple[float, Floats]]:
        """Start time, s, and points (P, 2) of each planned path."""
        return [
            (frame / rate_hz, path.position(np.linspace(0.0, path.length_m, _PATH_POINTS)))
            for frame, path in self._planned
        ]

    @property
    def count(self) -> int:
        """L."""
        return len(self.points_m)

    def observe(self, points_m: Floats) -> bool:
        """Advance n by the body's points (N + 1, 2); return whether all targets are reached.

        D_n is measured from the mass centre.
        """
        centre = points_m.sum(axis=0) / len(points_m)
        while self.index < self.count and self._has_reached_waypoint(centre):
            self.index += 1
        self.current.append(self.index)
        self.distance_m.append(hypot(*(self.points_m[self._frame_number] - centre)))
        return self.index == self.count

    def printed_aim_rad(self, points_m: Floats) -> float:
        """D_o of [PT] 2.6.2: direction from the mass centre to the target in force."""
        return _direction_rad(self.points_m[self._frame_number] - points_m.mean(axis=0))

    def aim_rad(self, points_m: Floats, heading_rad: float) -> float:
        """Direction from the head, where the next state begins, to a point ahead on the path.

        If the head is a body's length beyond a waypoint that it missed, a new path is planned from
        the body's mean heading. Printed is the direction from the mass centre, which lies half a
        body behind: that snake wanders (docs/synthesis.md).
        """
        head = points_m[0]
        length_m = float(np.hypot(*np.diff(points_m, axis=0).T).sum())
        s_m = self._along_m(head)
        waypoint = self._frame_number + int(np.argmax(self.required[self._frame_number :]))
        passed = s_m > self._marks_m[waypoint] + length_m and self.index < self.count
        if passed and self._replan is not None:
            self.missed += 1
            left = self._waypoints_m[int(self.required[: self.index].sum()) :]
            self.points_m = self.points_m[: self.index]
            self.required = self.required[: self.index]
            self._marks_m = self._marks_m[: self.index]
            self._ahead = self._ahead[: self.index]
            self._extend(self._replan(np.vstack([head, left]), heading_rad), left)
            s_m = 0.0
        self._head_s_m = min(s_m, self.path.length_m)
        return _direction_rad(self._on_path(s_m + self._carrot_m) - head)

    def _along_m(self, point_m: Floats) -> float:
        """Arc length of a point's projection; beyond the end along the path's last direction."""
        end_m = self.path.length_m
        s_m = self.path.nearest(point_m, self._head_s_m)
        if s_m < end_m - 1e-6:
            return s_m
        beyond = (point_m - self.path.position(end_m)) @ self._end_direction
        return end_m + max(float(beyond), 0.0)

    def _on_path(self, s_m: float) -> Floats:
        """Point (2,) at an arc length, beyond the end straight on."""
        beyond_m = max(s_m - self.path.length_m, 0.0)
        return self.path.position(s_m) + beyond_m * self._end_direction

    @property
    def _end_direction(self) -> Floats:
        end_rad = self.path.heading_rad(self.path.length_m)
        return np.array([np.cos(end_rad), np.sin(end_rad)])

    @property
    def _frame_number(self) -> int:
        return min(self.index, self.count - 1)

    def _has_reached_waypoint(self, centre_m: Floats) -> bool:
        k = self.index
        off = centre_m - self.points_m[k]
        distance = hypot(off[0], off[1])
        if distance < self.radius_m:
            return True
        if self.required[k]:
            return False
        x, y = self._ahead[k]
        ahead_m = x * off[0] + y * off[1]
        following_m = hypot(*(centre_m - self.points_m[k + 1]))
        past = bool(ahead_m > 0.0 and distance < 2.0 * self.radius_m)
        return past or following_m < self.radius_m


def _direction_rad(step_m: Floats) -> float:
    return float(np.arctan2(step_m[1], step_m[0]))
