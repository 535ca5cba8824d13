"""How long a join has to take: the shortest time in which it stays within the limits."""

import numpy as np
from numba.extending import register_jitable

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.smoothstep import (
    cubic,
    cubic_slope,
    quintic_bend,
    quintic_slope,
)
from snakewalk.controller.motion.source import Pace
from snakewalk.drivers.compiling import compiled

DURATIONS_S = np.geomspace(0.25, 32.0, 36)
BRAKE_SHARE = 0.4
"""Of the acceleration limit, for the brake of the error's speed."""
LEAST_BRAKE_S = 0.02
TOLERANCE = 0.02
"""A target at its limits and the last of an error add up to a little more than a limit."""
DELAY = 0.3
"""Share of a join before a slowed target speeds up: most of the error should be gone by then."""
register_jitable(cubic)  # the loops below call them
register_jitable(cubic_slope)
_X = np.linspace(0.0, 1.0, 25)
_Z = np.maximum(0.0, (_X - DELAY) / (1.0 - DELAY))
_SHAPES = np.array(
    [_X, cubic(_Z), cubic_slope(_Z) / (1.0 - DELAY), quintic_slope(_X), quintic_bend(_X)]
)


def shortest_join_s(
    rate: float, error_rad: Floats, error_rad_s: Floats, pace: Pace, limit: Pace
) -> tuple[float, float]:
    """Time of a join to a target that starts at ``rate``, and of the brake of the error's speed.

    The brake is as long as its acceleration asks for, but at most half of the join.

    Args:
        rate: 0 to 1.
        error_rad: (J,) that has to die out.
        error_rad_s: (J,) how fast it grows at first.
        pace: of the target.
        limit: of the robot.

    Returns:
        one of ``DURATIONS_S``, or NaN where none is long enough; the brake, s.

    """
    brakes = (1.5 * np.abs(error_rad_s) / (BRAKE_SHARE * limit.acceleration_rad_s2)).max()
    brake_s = max(float(brakes), LEAST_BRAKE_S)
    duration_s = _shortest(
        DURATIONS_S,
        _SHAPES,
        rate,
        brake_s,
        np.array([error_rad, error_rad_s, pace.speed_rad_s, pace.acceleration_rad_s2]),
        (1.0 + TOLERANCE) * np.array([limit.speed_rad_s, limit.acceleration_rad_s2]),
    )
    return duration_s, min(0.5 * duration_s, brake_s)


@compiled("boolean(float64, float64[:, ::1], float64, float64, float64[:, ::1], float64[:, ::1])")
def _within(
    duration: float, shapes: Floats, rate: float, brake: float, joins: Floats, limits: Floats
) -> bool:
    """Whether the most that target and error can be together stays within the limits."""
    error, error_speed, speed, acceleration = joins[0], joins[1], joins[2], joins[3]
    for i in range(shapes.shape[1]):
        r = rate + (1.0 - rate) * shapes[1, i]
        dr = (1.0 - rate) * shapes[2, i] / duration
        dp, ddp = shapes[3, i] / duration, shapes[4, i] / duration**2
        y = min(shapes[0, i] * duration / brake, 1.0)
        left, dleft = 1.0 - cubic(y), -cubic_slope(y) / brake
        for j in range(len(error)):
            total = error[j] + 0.5 * brake * error_speed[j]
            if r * speed[j] + abs(error_speed[j] * left - total * dp) > limits[0, j]:
                return False
            hard = abs(error_speed[j] * dleft - total * ddp)
            if dr * speed[j] + r * r * acceleration[j] + hard > limits[1, j]:
                return False
    return True


@compiled(
    "float64(float64[::1], float64[:, ::1], float64, float64, float64[:, ::1], float64[:, ::1])"
)
def _shortest(
    durations: Floats, shapes: Floats, rate: float, brake: float, joins: Floats, limits: Floats
) -> float:
    for duration in durations:
        if _within(duration, shapes, rate, min(0.5 * duration, brake), joins, limits):
            return float(duration)
    return float(np.nan)
