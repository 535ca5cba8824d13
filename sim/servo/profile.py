"""Profiles: trajectories of a servo towards a new goal (e-manual, section Profile).

Velocity-based profiles limit speed and acceleration. Time-based ones (Drive Mode(10), bit 2) state
the duration of the move and of its acceleration; they are converted when the goal is set. Profile
Velocity 0 is a step, Profile Acceleration 0 a rectangle, else a trapezoid or triangle.
"""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled, readonly_array

_READ = readonly_array(layout="C")
_MASK = readonly_array("boolean")

STEP = 0x00
TRIANGULAR = 0x20
TRAPEZOIDAL = 0x30
"""Moving Status(123), bits 4 and 5; 0x10 is a rectangular profile."""


class Trajectory:
    """Positions (S,) that move to goals with limits of speed and acceleration (inf: none).

    ``rad_s_per_velocity`` and ``rad_s2_per_acceleration`` (S,) are the units of the registers.
    """

    def __init__(
        self, servos: int, rad_s_per_velocity: ArrayLike, rad_s2_per_acceleration: ArrayLike
    ) -> None:
        self._rad_s, self._rad_s2 = (
            np.asarray(unit, np.float64) for unit in (rad_s_per_velocity, rad_s2_per_acceleration)
        )
        self.position = np.zeros(servos)
        self.velocity = np.zeros(servos)
        self.goal = np.zeros(servos)
        self.acceleration = np.zeros(servos)
        """Acceleration of the last step, for the feed-forward."""
        self.kind = np.zeros(servos, np.uint8)
        """Moving Status bits of the profile in use."""
        self._speed = np.full(servos, np.inf)
        self._ramp = np.full(servos, np.inf)

    @property
    def ongoing(self) -> Bools:
        """(S,) whether the trajectory has not reached its goal."""
        return np.asarray((self.position != self.goal) | (self.velocity != 0.0))

    def restart(self, which: Bools, position: Floats) -> None:
        """Restart at a position, at rest."""
        self.position[which] = self.goal[which] = position[which]
        self.velocity[which] = self.acceleration[which] = 0.0

    def set_goals(self, goal: Floats, velocity: Floats, ramp: Floats, timed: Bools) -> None:
        """Set new goals, rad, with the present profile registers."""
        new = goal != self.goal
        if not new.any():
            return
        distance = np.abs(goal - self.position)
        total_s = velocity * 1e-3
        ramp_s = np.minimum(ramp * 1e-3, 0.5 * total_s)
        with np.errstate(divide="ignore", invalid="ignore"):
            timed_speed = np.where(total_s > 0.0, distance / (total_s - ramp_s), np.inf)
            timed_ramp = np.where(ramp_s > 0.0, timed_speed / ramp_s, np.inf)
        speed = np.where(velocity > 0.0, velocity * self._rad_s, np.inf)
        slope = np.where(ramp > 0.0, ramp * self._rad_s2, np.inf)
        self._speed[new] = np.where(timed, timed_speed, speed)[new]
        self._ramp[new] = np.where(timed, timed_ramp, slope)[new]
        self.goal[new] = goal[new]
        step = ~np.isfinite(self._speed)
        with np.errstate(invalid="ignore", over="ignore"):
            short = distance * self._ramp < self._speed**2
        kind = np.where(np.isfinite(self._ramp), np.where(short, TRIANGULAR, TRAPEZOIDAL), 0x10)
        self.kind[new] = np.where(step, STEP, kind)[new]

    def advance(self, seconds: float, which: Bools) -> None:
        """Advance those of ``which`` (S,) by one control step."""
        columns = (self.position, self.velocity, self.acceleration)
        _advance(seconds, which, self.goal, self._speed, self._ramp, *columns)


@compiled(f"void(float64, {_MASK}, {', '.join([_READ] * 3)}, {', '.join(['float64[::1]'] * 3)})")
def _advance(
    seconds: float,
    which: Bools,
    goal: Floats,
    speed: Floats,
    ramp: Floats,
    position: Floats,
    velocity: Floats,
    acceleration: Floats,
) -> None:
    for k in range(len(position)):
        if not which[k]:
            continue
        if not np.isfinite(speed[k]):
            position[k], velocity[k], acceleration[k] = goal[k], 0.0, 0.0
            continue
        distance = goal[k] - position[k]
        brake = ramp[k] * seconds
        limit = np.inf
        if np.isfinite(brake):  # so fast that later steps can still stop in time
            root = np.sqrt(1.0 + 8.0 * abs(distance) / max(brake * seconds, 1e-300))
            limit = 0.5 * brake * (root - 1.0)
        speed_now = np.sign(distance) * min(speed[k], limit, abs(distance) / seconds)
        moved = velocity[k] + min(max(speed_now - velocity[k], -brake), brake)
        acceleration[k] = (moved - velocity[k]) / seconds
        if abs(distance - moved * seconds) < 1e-9:
            position[k], velocity[k] = goal[k], 0.0
        else:
            position[k], velocity[k] = position[k] + moved * seconds, moved
