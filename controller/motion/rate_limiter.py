"""Rate limiter: joints follow a target within limits of speed and acceleration."""

import numpy as np

from snakewalk.config.arrays import Floats


class RateLimiter:
    """A second-order follower of target angles."""

    def __init__(
        self,
        angle_rad: Floats,
        speed_limit_rad_s: float,
        acceleration_limit_rad_s2: float,
        gain_per_s: float = 12.0,
    ) -> None:
        self.angle_rad = np.array(angle_rad, dtype=float)
        self.speed_rad_s = np.zeros(len(self.angle_rad))
        self._speed = speed_limit_rad_s
        self._acceleration = acceleration_limit_rad_s2
        self._gain = gain_per_s

    def step(self, dt_s: float, target_rad: Floats) -> Floats:
        """Advance by ``dt_s`` towards ``target_rad`` (n,); return the angles (n,).

        The joint can always stop at the target from the requested speed.
        """
        if dt_s <= 0.0:
            return self.angle_rad
        error = target_rad - self.angle_rad
        stoppable = np.sqrt(self._acceleration * np.abs(error))
        most = np.minimum(np.minimum(self._gain * np.abs(error), stoppable), self._speed)
        change = np.sign(error) * most - self.speed_rad_s
        room = self._acceleration * dt_s
        self.speed_rad_s = self.speed_rad_s + np.clip(change, -room, room)
        self.angle_rad = self.angle_rad + dt_s * self.speed_rad_s
        return self.angle_rad
