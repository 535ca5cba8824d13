"""Dead reckoning of the last seconds, for measurements that arrive late."""

import math
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats

HISTORY_S = 2.0
"""Largest age of a late measurement."""
_ROOM = 4096


@dataclass(frozen=True, slots=True)
class Moment:
    """The estimate at one time, in the drifting frame of dead reckoning."""

    time_s: float
    place: Floats
    """(3,) x, y, heading of the head link."""
    joint_rad: Floats
    """(J,) joint angles, rad."""


class MotionHistory:
    """Moments of the last ``HISTORY_S``, in order of time; headings are unwrapped."""

    def __init__(self, joints: int) -> None:
        self._rows = np.empty((_ROOM, 4 + joints))
        self._first = self._end = 0

    def __len__(self) -> int:
        return self._end - self._first

    def add(self, moment: Moment) -> None:
        """Add the newest moment."""
        if self._end == _ROOM:
            kept = self._rows[self._first : self._end].copy()
            self._first, self._end = 0, len(kept)
            self._rows[: len(kept)] = kept
        row = self._rows[self._end]
        row[0], row[1:4], row[4:] = moment.time_s, moment.place, moment.joint_rad
        if len(self):
            before = self._rows[self._end - 1, 3]
            row[3] = before + math.remainder(row[3] - before, math.tau)
        self._end += 1
        while self._rows[self._first, 0] < moment.time_s - HISTORY_S:
            self._first += 1

    @property
    def times_s(self) -> Floats:
        """(n,) times of the moments."""
        return self._rows[self._first : self._end, 0]

    @property
    def headings_rad(self) -> Floats:
        """(n,) unwrapped headings of the head link."""
        return self._rows[self._first : self._end, 3]

    def at(self, time_s: float) -> Moment:
        """Return the moment at a time, between two that were added; the nearest outside of them."""
        times = self.times_s
        if len(times) == 1:
            row = self._rows[self._first]
            return Moment(time_s, row[1:4].copy(), row[4:].copy())
        k = int(np.clip(np.searchsorted(times, time_s), 1, len(times) - 1)) + self._first
        before_row = self._rows[k - 1]
        two = self._rows[k]
        part = float(np.clip((time_s - before_row[0]) / (two[0] - before_row[0]), 0.0, 1.0))
        row = before_row + part * (two - before_row)
        return Moment(time_s, row[1:4], row[4:])
