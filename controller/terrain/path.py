"""A smooth path: a cubic spline through points in order, by arc length ([PT] 2.6.1)."""

from typing import Self

import numpy as np
import scipy  # scipy.interpolate loads when it is first used
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.drivers.compiling import compiled

_STEP_M = 0.01
WINDOW_M = 1.5
"""Distance ahead within which a point is projected: onto its own lap, where a path crosses
itself."""


class SplinePath:
    """Natural cubic spline over chord length, tabulated every centimetre.

    Raises:
        InputError: fewer than two distinct points.

    """

    def __init__(self, points_m: ArrayLike) -> None:
        points = np.asarray(points_m, dtype=float)
        is_distinct = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-6])
        points = points[is_distinct]
        if len(points) < 2:
            raise InputError("a path needs two different points: the start and a waypoint")
        chord = arc_lengths(points)
        spline = scipy.interpolate.CubicSpline(chord, points, bc_type="natural")
        self._tabulate(spline(np.linspace(0.0, chord[-1], max(2, round(chord[-1] / _STEP_M) + 1))))

    @classmethod
    def tabulated(cls, fine_m: Floats) -> Self:
        """Return a path through points (n, 2) a centimetre apart, without a spline."""
        path = cls.__new__(cls)
        path._tabulate(fine_m)
        return path

    def _tabulate(self, fine_m: Floats) -> None:
        self._s = arc_lengths(fine_m)
        self._points = fine_m
        self._xy = np.ascontiguousarray(fine_m.T)

    @property
    def length_m(self) -> float:
        """Arc length of the path."""
        return float(self._s[-1])

    def position(self, s_m: ArrayLike) -> Floats:
        """(..., 2) points at arc lengths, clamped to the ends."""
        s = np.asarray(s_m, dtype=float)
        points = np.empty((*s.shape, 2))
        points[..., 0] = np.interp(s, self._s, self._xy[0])
        points[..., 1] = np.interp(s, self._s, self._xy[1])
        return points

    def piece_m(self, begin_m: float, end_m: float) -> Floats:
        """(n, 2) points of a piece, about a centimetre apart, both ends included."""
        count = max(2, round((end_m - begin_m) / _STEP_M) + 1)
        return self.position(np.linspace(begin_m, end_m, count))

    def heading_rad(self, s_m: float) -> float:
        """Direction of the path at an arc length."""
        before, after = self.position(np.array([s_m - _STEP_M, s_m + _STEP_M]))
        return float(np.arctan2(*(after - before)[::-1]))

    def nearest(
        self, point_m: ArrayLike, from_s_m: float = 0.0, window_m: float = WINDOW_M
    ) -> float:
        """Arc length of the closest point in ``[from_s_m, from_s_m + window_m]``."""
        at_s_m = np.array([from_s_m])
        gap_m = np.empty(1)
        point = np.asarray(point_m, dtype=float)[None, :2]
        _project(self._s, self._xy, np.ascontiguousarray(point), at_s_m, gap_m, window_m)
        return float(at_s_m[0])

    def project(self, points_m: Floats, s_m: Floats, gap_m: Floats) -> None:
        """Project each point onto the path, within ``WINDOW_M`` ahead of its last arc length.

        Args:
            points_m: (n, 2) in the world.
            s_m: (n,) arc lengths; updated.
            gap_m: (n,) out: distances from the path.

        """
        _project(self._s, self._xy, points_m, s_m, gap_m, WINDOW_M)

    def first_pass(self, point_m: ArrayLike, from_s_m: float = 0.0) -> float:
        """Arc length, at ``from_s_m`` or later, of the first closest approach to a point.

        If passes differ by less than a centimetre, the first counts: a lap may end where it
        began.
        """
        low = min(int(np.searchsorted(self._s, from_s_m - 1e-9)), len(self._s) - 1)
        gap = np.hypot(*(self._points[low:] - np.asarray(point_m, dtype=float)[:2]).T)
        close = np.flatnonzero(gap <= gap.min() + _STEP_M)
        run = close[: int(np.argmax(np.append(np.diff(close), 2) > 1)) + 1]
        return float(self._s[low + run[np.argmin(gap[run])]])

    def passes(self, points_m: ArrayLike) -> list[float]:
        """Arc lengths of the first closest approaches to points (n, 2), in their order."""
        passes_m = list[float]()
        at_m = 0.0
        for point in np.asarray(points_m, dtype=float):
            at_m = self.first_pass(point, at_m)
            passes_m.append(at_m)
        return passes_m


@compiled(
    "void(float64[::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64)",
    makes_arrays=False,
)
def _project(
    marks_m: Floats, xy_m: Floats, points_m: Floats, s_m: Floats, gap_m: Floats, window_m: float
) -> None:
    for k in range(len(points_m)):
        end_m = s_m[k] + window_m
        low, high = 0, len(marks_m) - 1  # bisect for the first mark that is not behind
        while low < high:
            middle = (low + high) // 2
            if marks_m[middle] < s_m[k] - 1e-9:
                low = middle + 1
            else:
                high = middle
        least = np.inf
        best = low
        x, y = points_m[k, 0], points_m[k, 1]
        for mark in range(low, len(marks_m)):
            if mark > low and marks_m[mark] > end_m:
                break
            square = (xy_m[0, mark] - x) ** 2 + (xy_m[1, mark] - y) ** 2
            if square < least:
                least = square
                best = mark
        s_m[k], gap_m[k] = marks_m[best], np.sqrt(least)
