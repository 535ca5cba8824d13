"""The start ramp: from where the joints are to where the motion begins, within their limits."""

import numpy as np

from snakewalk.config.arrays import Floats

# Peak speed and acceleration of the quintic 10 t^3 - 15 t^4 + 6 t^5 on [0, 1].
_PEAK_SPEED = 1.875
_PEAK_ACCELERATION = 10.0 / np.sqrt(3.0)


class Ramp:
    """Quintic blend: speed and acceleration are zero at both ends."""

    def __init__(
        self, start_rad: Floats, goal_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float
    ) -> None:
        self._start, self._goal = np.array(start_rad), np.array(goal_rad)
        way = float(np.abs(self._goal - self._start).max(initial=0.0))
        self.duration_s = max(
            way * _PEAK_SPEED / speed_rad_s,
            float(np.sqrt(way * _PEAK_ACCELERATION / acceleration_rad_s2)),
        )

    def at(self, time_s: float) -> Floats:
        """Joint angles (J,) after ``time_s``; the goal from ``duration_s`` on."""
        t = 1.0 if self.duration_s == 0.0 else min(max(time_s / self.duration_s, 0.0), 1.0)
        blend = t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
        return np.asarray(self._start + blend * (self._goal - self._start))
