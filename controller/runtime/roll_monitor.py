"""Roll monitor: reports when the body lies on its side or its back, and when it has come round."""

import numpy as np

from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.roll_compensation import body_roll_rad

OVER_RAD = np.deg2rad(75.0)
"""Mean roll of the links from which on it has rolled over (ours)."""
UPRIGHT_RAD = np.deg2rad(50.0)
"""Mean roll below which the body lies well again (ours)."""
_LASTS_S = 1.5
"""Time for which the body must lie on its side before a report (ours): a roll uphill is shorter."""


class RollMonitor:
    """Call once a cycle; returns a line when the body has rolled over or righted itself."""

    def __init__(self) -> None:
        self._over = False
        self._since_s: float | None = None

    def update(self, view: BodyView, time_s: float) -> str | None:
        """Process the body's pose at a time; returns a change, or None."""
        roll_rad = abs(body_roll_rad(view))
        changed = roll_rad > OVER_RAD if not self._over else roll_rad < UPRIGHT_RAD
        if not changed:
            self._since_s = None
            return None
        if self._since_s is None:
            self._since_s = time_s
        if time_s - self._since_s < _LASTS_S:
            return None
        self._over = not self._over
        self._since_s = None
        if self._over:
            return f"rolled over: the links lie {np.rad2deg(roll_rad):.0f} degrees off upright"
        return "upright again"
