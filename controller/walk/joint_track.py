"""Joint track: joint goals along the path of the head, with a continuous first derivative.

A quadratic B-spline connects the joint angles at whole heads, where the skeleton falls on the
samples. So its second derivative is known, and a time law can limit joint speed *and* acceleration.
"""

import copy
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.drivers.compiling import compiled


class JointTrack:
    """Joint angles of a body whose head has travelled ``head`` segments along ``track``."""

    def __init__(
        self,
        track: AngleTrack,
        joints_of: Callable[[Floats], Floats],
        limit_rad: ArrayLike = np.inf,
    ) -> None:
        """Follow ``track``; ``joints_of`` maps skeletons (..., N) to joints (..., J).

        A window between two shapes that bends beyond ``limit_rad`` (J,) is clipped. The next
        decision corrects the resulting heading.
        """
        self.track = track
        self._limit_rad = np.asarray(limit_rad, dtype=float)
        self._joints = joints_of
        self.first = track.points
        """Head at the first sample of the tables."""
        self._q = self._joints_of(track.body_rad(float(track.points)))[None]

    def _joints_of(self, body_rad: Floats) -> Floats:
        joint_rad = self._joints(body_rad)
        clipped = np.minimum(np.maximum(joint_rad, -self._limit_rad), self._limit_rad)
        return np.asarray(clipped)

    def on(self, track: AngleTrack) -> "JointTrack":
        """Return a copy on a track that begins like this one."""
        other = copy.copy(self)
        other.track = track
        return other

    def recent(self, first: int) -> tuple["JointTrack", int]:
        """Return a copy whose tables begin at a head, and the number of samples left out.

        Its heads count from the start of the remaining track.
        """
        other = copy.copy(self)
        first = max(first, self.first)
        left_out = first - self.track.points
        other.track = self.track.without(left_out)
        other._q = self._q[first - self.first :].copy()
        other.first = first - left_out
        return other, left_out

    def restart(self) -> None:
        """Begin again at the end of the track, where the body is."""
        self.first = self.track.end
        self._q = self._joints_of(self.track.body_rad(float(self.first)))[None]

    @property
    def last(self) -> int:
        """Largest head whose goal does not depend on future samples, plus one."""
        return self.first + len(self._q) - 1

    def grow(self) -> bool:
        """Read the samples appended to the track; return whether there were any."""
        if self.track.end == self.last:
            return False
        bodies = self.track.bodies_rad(self.last + 1, self.track.end)
        self._q = np.concatenate([self._q, self._joints_of(bodies)])
        return True

    def goal_rad(self, head: float) -> Floats:
        """(J,) joint angles; beyond the known track the spline continues straight."""
        goal = np.empty(self._q.shape[1])
        _spline(self._q, head - self.first, goal)
        return goal

    def bends(self, start: int) -> tuple[Floats, Floats]:
        """Largest |dq/dS| and |d2q/dS2| over the joints near each whole head from ``start``.

        Returns:
            Two arrays (last - start + 1,): rad per segment and rad per segment squared, each the
            largest within one segment to either side.

        """
        low = max(start - 2 - self.first, 0)
        q = self._q[low:]
        if len(q) < 2:
            return np.zeros(1), np.zeros(1)
        slope = np.empty(len(q))
        turn = np.empty(len(q))
        _bends(q, slope, turn)
        skip = start - self.first - low
        return slope[skip:], turn[skip:]


@compiled("void(float64[:, ::1], float64[::1], float64[::1])")
def _bends(q: Floats, slope: Floats, turn: Floats) -> None:
    """Largest |dq/dS| and |d2q/dS2| of ``q`` (n, J) within one row to either side, (n,)."""
    last = len(q) - 1
    for k in range(last + 1):
        slope[k] = turn[k] = 0.0
    for k in range(last):
        step = bend = 0.0
        for j in range(q.shape[1]):
            step = max(step, abs(q[k + 1, j] - q[k, j]))
            if k > 0:
                bend = max(bend, abs((q[k + 1, j] - q[k, j]) - (q[k, j] - q[k - 1, j])))
        slope[k], slope[k + 1] = max(slope[k], step), max(slope[k + 1], step)
        for near in range(max(k - 1, 0), k + 2):
            turn[near] = max(turn[near], bend)


@compiled("void(float64[:, ::1], float64, float64[::1])", makes_arrays=False)
def _spline(q: Floats, position: float, goal: Floats) -> None:
    """Write the quadratic B-spline of table ``q`` (n, J) at ``position`` into ``goal`` (J,)."""
    last = len(q) - 1
    middle = int(min(max(np.rint(position), 0.0), float(last)))
    t = position - middle + 0.5
    before = 0.5 * (1.0 - t) ** 2
    base = 0.5 + t - t * t
    after = 0.5 * t * t
    for joint in range(len(goal)):
        middle_rad = q[middle, joint]
        low, high = q[max(middle - 1, 0), joint], q[min(middle + 1, last), joint]
        if middle == 0:
            low = 2.0 * middle_rad - high
        if middle == last:  # a table of one row is constant
            high = 2.0 * middle_rad - low
        goal[joint] = before * low + base * middle_rad + after * high
