"""A smooth path: a cubic spline through points in order, by arc length ([PT] 2.6.1)."""

import math
from bisect import bisect_left, bisect_right

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from config.errors import InputError

Floats = NDArray[np.float64]
_STEP_M = 0.01


class SplinePath:
    """Natural cubic spline over chord length, tabulated every centimetre.

    Raises:
        InputError: fewer than two distinct points.

    """

    def __init__(self, points_m: ArrayLike) -> None:
        points = np.asarray(points_m, dtype=float)
        apart = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-6])
        points = points[apart]
        if len(points) < 2:
            raise InputError("a path needs two different points: the start and a waypoint")
        chord = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        spline = CubicSpline(chord, points, bc_type="natural")
        fine = spline(np.linspace(0.0, chord[-1], max(2, round(chord[-1] / _STEP_M) + 1)))
        self._s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(fine, axis=0).T))])
        self._points = fine
        self._xy = np.ascontiguousarray(fine.T)
        self._marks: list[float] = self._s.tolist()

    @property
    def length_m(self) -> float:
        """Arc length of the whole path."""
        return float(self._s[-1])

    def position(self, s_m: ArrayLike) -> Floats:
        """(..., 2) points at arc lengths, clamped to the ends."""
        s = np.asarray(s_m, dtype=float)
        points = np.empty((*s.shape, 2))
        points[..., 0] = np.interp(s, self._s, self._xy[0])
        points[..., 1] = np.interp(s, self._s, self._xy[1])
        return points

    def gap_m(self, point_m: Floats, s_m: float) -> float:
        """Distance of a point (2,) from the path's mark at ``s_m``, as ``nearest`` gives it."""
        low = min(bisect_left(self._marks, s_m), len(self._marks) - 1)
        return math.dist(self._points[low], point_m)

    def heading_rad(self, s_m: float) -> float:
        """Direction of the path at an arc length."""
        before, after = self.position(np.array([s_m - _STEP_M, s_m + _STEP_M]))
        return float(np.arctan2(*(after - before)[::-1]))

    def nearest(self, point_m: ArrayLike, from_s_m: float = 0.0, window_m: float = 1.5) -> float:
        """Arc length of the closest point in ``[from_s_m, from_s_m + window_m]``.

        The window keeps a follower on its own lap where a path crosses or closes on itself.
        """
        marks = self._marks
        low = min(bisect_left(marks, from_s_m - 1e-9), len(marks) - 1)
        high = max(bisect_right(marks, from_s_m + window_m), low + 1)
        way = self._xy[:, low:high] - np.asarray(point_m, dtype=float)[:2, None]
        way *= way
        return marks[low + int((way[0] + way[1]).argmin())]

    def first_pass(self, point_m: ArrayLike, from_s_m: float = 0.0) -> float:
        """Arc length, from ``from_s_m`` on, at which the path first comes nearest to a point.

        Of several passes as near as a table's step, the first counts: a lap may end where it began.
        """
        low = min(int(np.searchsorted(self._s, from_s_m - 1e-9)), len(self._s) - 1)
        gap = np.hypot(*(self._points[low:] - np.asarray(point_m, dtype=float)[:2]).T)
        close = np.flatnonzero(gap <= gap.min() + _STEP_M)
        run = close[: int(np.argmax(np.append(np.diff(close), 2) > 1)) + 1]
        return float(self._s[low + run[np.argmin(gap[run])]])
