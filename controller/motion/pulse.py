"""How fast the head may travel along the track: the joints' speed is the limit (METHOD 12)."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controller.motion.angle_track import AngleTrack

Floats = NDArray[np.float64]
# Segments around the head where slopes are looked up; half steps, as junctions have kinks.
_LOOK = np.arange(-1.0, 3.1, 0.5)


class Pulse:
    """Advances the head along an angle track, ``u = min(u0, limit / max |dq/dS|)`` with a ramp."""

    def __init__(
        self,
        joints_of: Callable[[Floats], Floats],
        wanted_segments_s: float,
        joint_speed_limit_rad_s: float,
        ramp_time_s: float = 1.0,
    ) -> None:
        self._joints_of = joints_of
        self._wanted = wanted_segments_s
        self._limit = joint_speed_limit_rad_s
        self._slew = wanted_segments_s / ramp_time_s
        self.speed_segments_s = 0.0

    def advance(self, track: AngleTrack, head: float, dt_s: float) -> float:
        """Return the head position after ``dt_s``; never beyond the track's end."""
        look = np.clip(head + _LOOK, track.points, track.end)
        bodies = np.stack([track.body_rad(float(h)) for h in look])
        run = np.diff(look)
        moved = np.abs(np.diff(self._joints_of(bodies), axis=0)).max(axis=1)
        steepest = float(np.max(np.divide(moved, run, out=np.zeros_like(run), where=run > 1e-9)))
        allowed = min(self._wanted, self._limit / max(steepest, 1e-9))
        self.speed_segments_s = min(allowed, self.speed_segments_s + self._slew * dt_s)
        return min(head + self.speed_segments_s * dt_s, float(track.end))
