"""The start ramp: from where the joints are to where the motion begins, within their limits."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.smoothstep import QUINTIC_BEND_MAX, QUINTIC_SLOPE_MAX, quintic


class Ramp:
    """Quintic blend: speed and acceleration are zero at both ends."""

    def __init__(
        self, start_rad: Floats, goal_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float
    ) -> None:
        self._start, self._goal = np.array(start_rad), np.array(goal_rad)
        way = float(np.abs(self._goal - self._start).max(initial=0.0))
        self.duration_s = max(
            way * QUINTIC_SLOPE_MAX / speed_rad_s,
            float(np.sqrt(way * QUINTIC_BEND_MAX / acceleration_rad_s2)),
        )

    def at(self, time_s: float) -> Floats:
        """Joint angles (J,) after ``time_s``; the goal from ``duration_s`` on."""
        t = 1.0 if self.duration_s == 0.0 else min(max(time_s / self.duration_s, 0.0), 1.0)
        return np.asarray(self._start + quintic(t) * (self._goal - self._start))
