"""Time law: limits the head's speed along the track by joint speed and acceleration.

A speed limit alone, ``u = min(u0, limit / max |dq/dS|)``, lets the head's speed jump. Here half of
the acceleration limit is for bending (``q'' u^2``), half for speeding up and braking (``q'
du/dt``). Braking looks ahead over the known track.
"""

import copy

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.joint_track import JointTrack
from snakewalk.drivers.compiling import compiled

_LEAST_BEND = 1e-9
_CLOSE_SEGMENTS = 0.2
_BACK_SHARE = 0.3
"""Share of the usual gain in speed with which a head turns back (ours)."""


class TimeLaw:
    """Time law of a head on a joint track."""

    def __init__(
        self,
        joints: JointTrack,
        cruise_segments_s: float,
        *,
        speed_limit_rad_s: float,
        acceleration_limit_rad_s2: float,
        ramp_time_s: float = 1.0,
    ) -> None:
        """Start at rest on the first head of ``joints``; ``ramp_time_s`` to the cruise speed."""
        self.joints = joints
        self._cruise = cruise_segments_s
        self._speed_limit = speed_limit_rad_s
        self._half_acceleration = 0.5 * acceleration_limit_rad_s2
        self._slew = cruise_segments_s / ramp_time_s
        self._stopping = False
        self._least = cruise_segments_s
        self._come_to_rest()

    def _come_to_rest(self) -> None:
        self.head = float(self.joints.first)
        """Segments travelled."""
        self.speed_segments_s = 0.0
        self._first = self.joints.first
        self._allowed = np.zeros(1)  # the next motion is unknown
        self._slope = np.zeros(1)

    def on(self, track: AngleTrack) -> "TimeLaw":
        """Return an independent copy on a track that begins like its own."""
        other = copy.copy(self)
        other.joints = self.joints.on(track)
        return other

    def recent(self, segments: int) -> "TimeLaw":
        """Return an independent copy without the track ``segments`` behind the head.

        Its heads count from the start of the remaining track.
        """
        other = copy.copy(self)
        other.joints, left_out = self.joints.recent(int(self.head) - segments)
        other.head = self.head - left_out
        other._first = self._first - left_out
        return other

    def restart(self) -> None:
        """Begin again, at rest, at the end of the track."""
        self.joints.restart()
        self._come_to_rest()

    def stop(self) -> None:
        """Slow down to rest."""
        self._stopping = True

    def go_on(self) -> None:
        """Return to the cruise speed."""
        self._stopping = False

    def advance(self, dt_s: float) -> float:
        """Advance by ``dt_s``; return the head, never beyond the known track."""
        if self.joints.grow():
            self._tabulate_speed()
        slew = -self._slew if self._stopping else self._slew
        travelled, self.speed_segments_s = _next_place_and_speed(
            self.head - self._first,
            self.speed_segments_s,
            dt_s,
            slew,
            self._half_acceleration,
            self._allowed,
            self._slope,
        )
        self.head = min(self._first + travelled, float(self.joints.last))
        return self.head

    def back(self, to_head: float, dt_s: float) -> bool:
        """Move the head back along its track by ``dt_s``; return whether it rests at ``to_head``.

        The speed is at most the lowest that any place so far allowed.
        """
        to_head = max(to_head, float(self.joints.first))
        left = max(self.head - to_head, 0.0)
        fastest = max(-self._least, -left)  # slower with each segment, to rest
        self.speed_segments_s = max(
            fastest, self.speed_segments_s - _BACK_SHARE * self._slew * dt_s
        )
        self.head = min(self.head + self.speed_segments_s * dt_s, float(self.joints.last))
        return left < _CLOSE_SEGMENTS

    def goal_rad(self) -> Floats:
        """(J,) joint goals at the head."""
        return self.joints.goal_rad(self.head)

    def _tabulate_speed(self) -> None:
        """Tabulate the allowed speed from the head onwards, braking included."""
        self._first = max(self.joints.first, int(self.head) - 1)
        slope, turn = self.joints.bends(self._first)
        self._slope = slope
        allowed = np.empty(len(slope))
        _allow(slope, turn, self._speed_limit, self._half_acceleration, self._cruise, allowed)
        # the unknown track may be as steep as the steepest so far: be able to brake for it
        self._least = min(self._least, float(allowed.min()))
        allowed[-1] = self._least
        _brake(allowed, slope, self._half_acceleration)
        self._allowed = allowed


@compiled("float64(float64[::1], float64)")
def _limit_at(allowed: Floats, position: float) -> float:
    """Speed limit between two places; its square is linear, as in uniform braking."""
    position = min(max(position, 0.0), len(allowed) - 1.0)
    low = max(min(int(position), len(allowed) - 2), 0)
    part = position - low
    if part == 0.0:
        return float(allowed[low])
    return float(np.sqrt(allowed[low] ** 2 * (1.0 - part) + allowed[low + 1] ** 2 * part))


@compiled(
    "UniTuple(float64, 2)(float64, float64, float64, float64, float64, float64[::1], float64[::1])",
    makes_arrays=False,
)
def _next_place_and_speed(
    position: float,
    speed: float,
    dt_s: float,
    slew: float,
    half_acceleration: float,
    allowed: Floats,
    slope: Floats,
) -> tuple[float, float]:
    """Return place (from the tables' start) and speed after ``dt_s``; ``slew`` < 0 stops."""
    bend = slope[max(min(int(position), len(slope) - 1), 0)]
    thrust = min(abs(slew), half_acceleration / max(bend, _LEAST_BEND))
    limit = min(_limit_at(allowed, position), _limit_at(allowed, position + speed * dt_s))
    speed = max(0.0, min(limit, speed + (thrust if slew > 0.0 else -thrust) * dt_s))
    return position + speed * dt_s, speed


@compiled("void(float64[::1], float64[::1], float64, float64, float64, float64[::1])")
def _allow(
    slope: Floats,
    turn: Floats,
    speed_limit: float,
    half_acceleration: float,
    cruise: float,
    allowed: Floats,
) -> None:
    """Write the speed allowed at each place: the least of it and its neighbours, without steps."""
    for k in range(len(slope)):
        allowed[k] = cruise
    for k in range(len(slope)):
        by_bend = np.sqrt(half_acceleration / max(turn[k], _LEAST_BEND))
        limit_here = min(speed_limit / max(slope[k], _LEAST_BEND), by_bend)
        for near in range(max(k - 1, 0), min(k + 2, len(slope))):
            allowed[near] = min(allowed[near], limit_here)


@compiled("void(float64[::1], float64[::1], float64)")
def _brake(allowed: Floats, slope: Floats, half_acceleration: float) -> None:
    """Limit each speed so that the body can brake to the next."""
    for k in range(len(allowed) - 2, -1, -1):
        brake = half_acceleration / max(slope[k], slope[k + 1], _LEAST_BEND)
        allowed[k] = min(allowed[k], np.sqrt(allowed[k + 1] ** 2 + 2.0 * brake))
