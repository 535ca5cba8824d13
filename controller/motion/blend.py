"""Joining one motion to another without a step.

At the join the joints differ from the new source by an error in angle and in speed. The new source
runs, and the error decays along a polynomial that starts with exactly that angle and speed: the sum
is C1 for any two sources. If the sum would be too fast, the new source starts at a slower rate,
down to rest, and speeds up meanwhile:

    q(t) = target(s(t)) + e(t),   s' = r0 + (1 - r0) S((x - d) / (1 - d)),   x = t / T
    e(t) = e0 + v0 B(t) - (e0 + v0 T_b / 2) P(x),   P(x) = 10 x^3 - 15 x^4 + 6 x^5

with S(y) = 3 y^2 - 2 y^3, 0 below 0 and 1 above 1, and d = ``DELAY``. B brakes the error's speed
within ``T_b``. T is the shortest time in which target and error together keep the limits of speed
and acceleration.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.smoothstep import (
    cubic,
    cubic_slope,
    cubic_sum,
    quintic,
    quintic_bend,
    quintic_slope,
)
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.drivers.compiling import callable_in_loops, compiled

DURATIONS_S = np.geomspace(0.25, 32.0, 36)
BRAKE_SHARE = 0.4
"""Share of the acceleration limit for the brake of the error's speed."""
LEAST_BRAKE_S = 0.02
TOLERANCE = 0.02
"""A target at its limits and the last of an error add up to a little more than a limit."""
DELAY = 0.3
"""Share of a join before a slowed target speeds up: most of the error should be gone by then."""
callable_in_loops(cubic)  # the compiled loops below call them
callable_in_loops(cubic_slope)
_X = np.linspace(0.0, 1.0, 25)
_Z = np.maximum(0.0, (_X - DELAY) / (1.0 - DELAY))
_SHAPES = np.array(
    [_X, cubic(_Z), cubic_slope(_Z) / (1.0 - DELAY), quintic_slope(_X), quintic_bend(_X)]
)


def shortest_join_s(
    rate: float, error_rad: Floats, error_rad_s: Floats, pace: Pace, limit: Pace
) -> tuple[float, float]:
    """Return the durations of a join to a target that starts at ``rate``, and of its brake.

    The brake is at most half of the join.

    Args:
        rate: 0 to 1.
        error_rad: (J,) error to remove.
        error_rad_s: (J,) its initial speed.
        pace: of the target.
        limit: of the robot.

    Returns:
        One of ``DURATIONS_S``, or NaN if none is long enough; the brake, s.

    """
    brakes = (1.5 * np.abs(error_rad_s) / (BRAKE_SHARE * limit.acceleration_rad_s2)).max()
    brake_s = max(float(brakes), LEAST_BRAKE_S)
    duration_s = _shortest_duration(
        DURATIONS_S,
        _SHAPES,
        rate,
        brake_s,
        np.array([error_rad, error_rad_s, pace.speed_rad_s, pace.acceleration_rad_s2]),
        (1.0 + TOLERANCE) * np.array([limit.speed_rad_s, limit.acceleration_rad_s2]),
    )
    return duration_s, min(0.5 * duration_s, brake_s)


@compiled("boolean(float64, float64[:, ::1], float64, float64, float64[:, ::1], float64[:, ::1])")
def _keeps_limits(
    duration: float, shapes: Floats, rate: float, brake: float, joins: Floats, limits: Floats
) -> bool:
    """Whether the largest sum of target and error keeps the limits."""
    error = joins[0]
    error_speed = joins[1]
    speed = joins[2]
    acceleration = joins[3]
    for i in range(shapes.shape[1]):
        r = rate + (1.0 - rate) * shapes[1, i]
        dr = (1.0 - rate) * shapes[2, i] / duration
        dp = shapes[3, i] / duration
        ddp = shapes[4, i] / duration**2
        y = min(shapes[0, i] * duration / brake, 1.0)
        rest = 1.0 - cubic(y)
        drest = -cubic_slope(y) / brake
        for j in range(len(error)):
            total = error[j] + 0.5 * brake * error_speed[j]
            if r * speed[j] + abs(error_speed[j] * rest - total * dp) > limits[0, j]:
                return False
            hard = abs(error_speed[j] * drest - total * ddp)
            if dr * speed[j] + r * r * acceleration[j] + hard > limits[1, j]:
                return False
    return True


@compiled(
    "float64(float64[::1], float64[:, ::1], float64, float64, float64[:, ::1], float64[:, ::1])"
)
def _shortest_duration(
    durations: Floats, shapes: Floats, rate: float, brake: float, joins: Floats, limits: Floats
) -> float:
    for duration in durations:
        if _keeps_limits(duration, shapes, rate, min(0.5 * duration, brake), joins, limits):
            return float(duration)
    return float(np.nan)


RATES = (1.0, 0.7, 0.4, 0.0)
"""Rates at which the target may start; slower ones are tried if faster ones last too long."""
LONGEST_JOIN_S = (0.5, 1.0, 1.6, np.inf)
"""Longest join that is accepted at each rate, s."""


@dataclass(frozen=True, slots=True)
class Join:
    """Parameters of one join."""

    rate: float
    """r0"""
    duration_s: float
    brake_s: float
    error_rad: Floats
    """(J,) e0"""
    error_rad_s: Floats
    """(J,) v0"""

    def source_time_s(self, t_s: float) -> float:
        """Time of the target's own motion at ``t_s``."""
        x, y = self._shares(t_s)
        sped_up = (1.0 - self.rate) * (1.0 - DELAY) * cubic_sum(y)
        blended = self.duration_s * (self.rate * x + sped_up)
        return float(blended + max(t_s - self.duration_s, 0.0))

    def source_rate(self, t_s: float) -> float:
        """Rate s' of the target at ``t_s``."""
        _, y = self._shares(t_s)
        return float(self.rate + cubic(y, 1.0 - self.rate))

    def _shares(self, t_s: float) -> tuple[float, float]:
        """Shares of the duration and of its part after the delay."""
        x = min(t_s / self.duration_s, 1.0) if self.duration_s > 0.0 else 1.0
        return x, max(0.0, (x - DELAY) / (1.0 - DELAY))

    def error_at(self, t_s: float) -> tuple[Floats, Floats]:
        """(J,) remaining error in angle and in speed."""
        if t_s >= self.duration_s:
            zero = np.zeros(len(self.error_rad))
            return zero, zero
        x = t_s / self.duration_s
        y = min(t_s / self.brake_s, 1.0)
        braked_s = min(t_s, self.brake_s) - self.brake_s * cubic_sum(y)
        rest = 1.0 - cubic(y)
        total = self.error_rad + 0.5 * self.brake_s * self.error_rad_s
        dp = quintic_slope(x) / self.duration_s
        return (
            self.error_rad + self.error_rad_s * braked_s - total * quintic(x),
            self.error_rad_s * rest - total * dp,
        )


def plan_join(angle_rad: Floats, speed_rad_s: Floats, target: MotionSource, limit: Pace) -> Join:
    """Choose rate and duration of a join from joints at an angle and speed (J,) to ``target``.

    A speed beyond its limit is clipped: otherwise no join could begin.

    Raises:
        ValueError: the target itself exceeds ``limit``.

    """
    error = angle_rad - target.goal_rad()
    speed_rad_s = np.clip(speed_rad_s, -limit.speed_rad_s, limit.speed_rad_s)
    velocity = target.velocity_rad_s()
    pace = target.pace()
    for rate, longest_s in zip(RATES, LONGEST_JOIN_S, strict=True):
        error_speed = speed_rad_s - rate * velocity
        if rate == 1.0 and max(np.abs(error).max(), np.abs(error_speed).max()) < 1e-9:
            return Join(1.0, 0.0, 0.0, error, error_speed)
        duration_s, brake_s = shortest_join_s(rate, error, error_speed, pace, limit)
        if duration_s <= longest_s:
            return Join(rate, duration_s, brake_s, error, error_speed)
    raise ValueError("a motion cannot be joined: it asks for more than the robot's limits")


class Blend(MotionWrapper):
    """A motion source: joins the joints' motion to a target, then follows the target."""

    def __init__(
        self, angle_rad: Floats, speed_rad_s: Floats, target: MotionSource, limit: Pace
    ) -> None:
        """Join joints at an angle and a speed (J,) to ``target``.

        Raises:
            ValueError: the target itself exceeds ``limit``.

        """
        super().__init__(target)
        self.target = target
        self._limit = limit
        self.join = plan_join(angle_rad, speed_rad_s, target, limit)
        self._t_s = 0.0

    @property
    def over(self) -> bool:
        """Whether the join is over and only the target runs."""
        return self._t_s >= self.join.duration_s

    @property
    def done(self) -> bool:
        """Whether the join is over and the target is done."""
        return self.over and self.target.done

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self.target.goal_rad() + self.join.error_at(self._t_s)[0]

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        rate = self.join.source_rate(self._t_s)
        return rate * self.target.velocity_rad_s() + self.join.error_at(self._t_s)[1]

    def pace(self) -> Pace:
        """The robot's limits during the join, then the target's pace."""
        return self.target.pace() if self.over else self._limit

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        if self.over:
            return self.target.step(dt_s, view)
        before_s = self.join.source_time_s(self._t_s)
        self._t_s += dt_s
        goal = self.target.step(self.join.source_time_s(self._t_s) - before_s, view)
        return goal + self.join.error_at(self._t_s)[0]
