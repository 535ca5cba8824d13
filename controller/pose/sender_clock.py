"""Clock of a sender relative to the run's: offset and drift from the fastest messages.

Messages have a varying delay. The line under all differences of arrival and stamp is the offset
plus the smallest delay; its slope is the drift.
"""

from collections import deque

import numpy as np

BIN_S = 1.0
"""Time over which the smallest difference counts (ours)."""
BINS = 60
DRIFT_AFTER = 15
"""Bins after which the drift is estimated (ours)."""
MOST_DRIFT = 5e-4
"""Clocks of computers drift by at most some 100 ppm; more is not believed (ours)."""


class SenderClock:
    """Estimates when a stamp was made, in time of the run."""

    def __init__(self) -> None:
        self._bins: deque[tuple[float, float]] = deque(maxlen=BINS)
        """Arrival and difference of the quickest message of each bin."""
        self._bin_ends_s = -np.inf
        self.drift = 0.0
        """Seconds per second by which the offset grows; 0 until it is known."""

    def add(self, stamp_s: float, arrival_s: float) -> None:
        """Accept the stamp of a message and its arrival."""
        difference = arrival_s - stamp_s
        if arrival_s >= self._bin_ends_s:
            self._bin_ends_s = arrival_s + BIN_S
            self._bins.append((arrival_s, difference))
            self._fit()
        elif difference < self._bins[-1][1]:
            self._bins[-1] = (arrival_s, difference)

    def offset_s(self, at_s: float) -> float:
        """Return time of the run minus time of the sender, with the smallest delay, at a time."""
        return min(value + self.drift * (at_s - time_s) for time_s, value in self._bins)

    def local_s(self, stamp_s: float, arrival_s: float) -> float:
        """Return when a message was stamped, as if the quickest message had no delay."""
        return min(stamp_s + self.offset_s(arrival_s), arrival_s)

    def _fit(self) -> None:
        """Fit the drift to the smallest differences of whole bins."""
        complete_bins = list(self._bins)[:-1]
        if len(complete_bins) < DRIFT_AFTER:
            return
        time_s, value = (np.array(column) for column in zip(*complete_bins, strict=True))
        slope = float(np.polyfit(time_s - time_s.mean(), value - value.mean(), 1)[0])
        self.drift = min(max(slope, -MOST_DRIFT), MOST_DRIFT)
