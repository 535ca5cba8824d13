"""Move from one shape to another, from rest to rest."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.smoothstep import (
    QUINTIC_BEND_MAX,
    QUINTIC_SLOPE_MAX,
    quintic,
    quintic_slope,
)


class Ramp:
    """Quintic blend: speed and acceleration are zero at both ends."""

    def __init__(
        self,
        start_rad: Floats,
        goal_rad: Floats,
        speed_rad_s: float,
        acceleration_rad_s2: float,
        least_s: float = 0.0,
    ) -> None:
        """Blend (J,) angles within limits, in ``least_s`` or longer."""
        self._start, self._goal = np.array(start_rad), np.array(goal_rad)
        reach_rad = float(np.abs(self._goal - self._start).max(initial=0.0))
        self.duration_s = max(
            least_s,
            reach_rad * QUINTIC_SLOPE_MAX / speed_rad_s,
            float(np.sqrt(reach_rad * QUINTIC_BEND_MAX / acceleration_rad_s2)),
        )

    def at(self, time_s: float) -> Floats:
        """Joint angles (J,) after ``time_s``; the goal from ``duration_s`` on."""
        return self._start + quintic(self._share(time_s)) * (self._goal - self._start)

    def velocity_rad_s(self, time_s: float) -> Floats:
        """Joint speeds (J,) after ``time_s``, of a ramp with a duration."""
        rate = quintic_slope(self._share(time_s)) / self.duration_s
        return rate * (self._goal - self._start)

    def peaks(self) -> tuple[Floats, Floats]:
        """Largest speeds and accelerations (J,), of a ramp with a duration."""
        reach_rad = np.abs(self._goal - self._start)
        return (
            QUINTIC_SLOPE_MAX * reach_rad / self.duration_s,
            QUINTIC_BEND_MAX * reach_rad / self.duration_s**2,
        )

    def _share(self, time_s: float) -> float:
        return 1.0 if self.duration_s == 0.0 else min(max(time_s / self.duration_s, 0.0), 1.0)
