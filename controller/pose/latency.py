"""Constant delay of measured poses, from the motion of the joints.

Stamps do not show a common delay. The head's heading swings with the joints, so the delay is the
shift at which measured and dead-reckoned headings differ least.
"""

from typing import Final

import numpy as np

from snakewalk.controller.pose.motion_history import MotionHistory

LONGEST_S: Final = 0.5
"""Longest delay that is looked for."""
STEP_S: Final = 0.02
SLOW_S: Final = 2.0
"""Slower differences are drift of dead reckoning (ours)."""
MEMORY_S: Final = 8.0
"""How long a measurement counts (ours)."""
CONTRAST: Final = 0.7
"""The best shift is believed if its error is below this share of the largest one (ours)."""
FOLLOW_S: Final = 2.0
"""Time constant with which the estimate follows (ours)."""


class LatencyEstimate:
    """Call ``add`` with each measured heading, in order of time."""

    def __init__(self, fixed_s: float | None = None) -> None:
        """Prepare; ``fixed_s`` is a delay that is known."""
        self._shifts_s = np.arange(0.0, LONGEST_S + 0.5 * STEP_S, STEP_S)
        self._mean = np.zeros(len(self._shifts_s))
        self._square = np.zeros(len(self._shifts_s))
        self._last: tuple[float, float] | None = None
        self._seconds = 0.0
        self._is_fixed = fixed_s is not None
        self.latency_s = fixed_s or 0.0
        """The estimate; 0 until the motion shows it."""
        self.is_known = self._is_fixed
        """Whether the delay is given, or the motion has shown it."""

    def add(self, stamped_s: float, heading_rad: float, history: MotionHistory) -> None:
        """Accept the heading of the head link, and when its message says that it was measured."""
        times = history.times_s
        if self._is_fixed or len(times) < 2 or stamped_s - LONGEST_S < times[0]:
            return
        if self._last is None:
            step_s = 0.0
            heading = heading_rad
        else:
            step_s = stamped_s - self._last[0]
            heading = self._last[1] + float(
                np.arctan2(*(f(heading_rad - self._last[1]) for f in (np.sin, np.cos)))
            )
        if not 0.0 <= step_s < 0.5 * SLOW_S:  # a gap: begin again
            self._last = None
            self._seconds = 0.0
            return
        moved = np.interp(stamped_s - self._shifts_s, times, history.headings_rad)
        off = heading - moved
        if self._last is None:
            self._mean[:], self._square[:] = off, 0.0
        self._last = (stamped_s, heading)
        self._mean += min(step_s / SLOW_S, 1.0) * (off - self._mean)
        self._seconds += step_s
        share = min(step_s / min(max(self._seconds, step_s), MEMORY_S), 1.0) if step_s else 0.0
        self._square += share * ((off - self._mean) ** 2 - self._square)
        self._choose(step_s)

    def _choose(self, step_s: float) -> None:
        best = int(self._square.argmin())
        if self._seconds < SLOW_S or best == len(self._shifts_s) - 1:
            return
        if self._square[best] > CONTRAST * self._square.max():
            return
        shift_s = self._shifts_s[best]
        if best > 0:
            a, b, c = self._square[best - 1 : best + 2]
            if a + c > 2.0 * b:
                shift_s += 0.5 * STEP_S * (a - c) / (a - 2.0 * b + c)
        follow = 1.0 if not self.is_known else min(step_s / FOLLOW_S, 1.0)
        self.is_known = True
        self.latency_s += follow * float(shift_s - self.latency_s)
