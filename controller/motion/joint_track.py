"""The angle track as this robot's joints see it: goals along the head's way, smooth to one order.

Joint angles are known at whole heads, where the skeleton falls on the samples; between them a
quadratic B-spline runs, so that slope is continuous and the second derivative is known everywhere.
That is what lets a time law keep joint speed *and* acceleration within limits.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controller.motion.angle_track import AngleTrack

Floats = NDArray[np.float64]


class JointTrack:
    """Joint angles of a body whose head has travelled ``head`` segments along ``track``."""

    def __init__(self, track: AngleTrack, joints_of: Callable[[Floats], Floats]) -> None:
        """Follow ``track``; ``joints_of`` maps skeletons (..., N) to joints (..., J)."""
        self.track = track
        self._joints_of = joints_of
        self.first = track.points
        """The head at which the first sample of the tables stands."""
        self._q = joints_of(track.body_rad(float(track.points)))[None]

    @property
    def last(self) -> int:
        """Largest head at which the goal no longer depends on what will be appended, plus one."""
        return self.first + len(self._q) - 1

    def grow(self) -> bool:
        """Take in what was appended to the track; true if anything was."""
        if self.track.end == self.last:
            return False
        heads = range(self.last + 1, self.track.end + 1)
        bodies = np.stack([self.track.body_rad(float(head)) for head in heads])
        self._q = np.concatenate([self._q, self._joints_of(bodies)])
        return True

    def goal_rad(self, head: float) -> Floats:
        """(J,) joint angles; at both ends of what is known the spline runs on straight."""
        middle = int(np.clip(round(head), self.first, self.last))
        t = head - middle + 0.5
        before, at, after = (self._at(middle + step) for step in (-1, 0, 1))
        return np.asarray(
            0.5 * (1.0 - t) ** 2 * before + (0.5 + t - t * t) * at + 0.5 * t * t * after
        )

    def bends(self, start: int) -> tuple[Floats, Floats]:
        """Largest |dq/dS| and |d2q/dS2| over the joints near each whole head from ``start`` on.

        Returns:
            Two arrays (last - start + 1,): rad per segment, rad per segment squared, each the
            largest within one segment to either side.

        """
        low = max(start - 2 - self.first, 0)
        q = self._q[low:]
        if len(q) < 2:
            return np.zeros(1), np.zeros(1)
        steps = np.diff(q, axis=0)
        slope = np.abs(steps).max(axis=1)
        turn = np.abs(np.diff(steps, axis=0)).max(axis=1) if len(q) > 2 else np.zeros(0)
        slope = np.maximum(np.append(slope, slope[-1]), np.insert(slope, 0, slope[0]))
        turn = np.concatenate([[0.0], turn, [0.0]])
        wide = np.maximum(turn, np.maximum(np.append(turn[1:], 0.0), np.insert(turn[:-1], 0, 0.0)))
        skip = start - self.first - low
        return slope[skip:], wide[skip:]

    def _at(self, head: int) -> Floats:
        k = head - self.first
        q = self._q
        if 0 <= k < len(q):
            return np.asarray(q[k])
        if len(q) == 1:
            return np.asarray(q[0])
        return np.asarray(2.0 * q[0] - q[1] if k < 0 else 2.0 * q[-1] - q[-2])
