"""A curve in space by its arc length, along which a body can be laid."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig

SAMPLES_A_LINK = 24
"""Of the curve, over the length of a link."""


class SpaceCurve:
    """A curve by arc length, densely sampled."""

    def __init__(self, robot: RobotConfig, curve_m: ArrayLike) -> None:
        points = np.asarray(curve_m, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
            raise InputError(f"a backbone curve has four points (x, y, z) or more: {points.shape}")
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not np.isfinite(points).all() or steps.min() <= 0.0:
            raise InputError("a backbone curve's points are finite, no two in a row the same")
        spline = CubicSpline(np.concatenate([[0.0], steps.cumsum()]), points)
        fine = np.linspace(0.0, spline.x[-1], 20 * len(points) + 2000)
        way = np.linalg.norm(np.diff(spline(fine), axis=0), axis=1)
        run = np.concatenate([[0.0], way.cumsum()])
        if run[-1] < robot.length_m * (1.0 - 1e-6):
            raise InputError(
                f"the curve is {run[-1]:.3f} m long; robot {robot.name} has {robot.length_m:.3f} m"
            )
        count = int(np.ceil(run[-1] / robot.link_length_m * SAMPLES_A_LINK)) + 1
        self.run_m = np.linspace(0.0, run[-1], count)
        at = np.interp(self.run_m, run, fine)
        self.points_m: Floats = np.asarray(spline(at))
        self._by_run = CubicSpline(self.run_m, self.points_m)
        tangents = self._by_run(self.run_m, 1)
        self.tangents: Floats = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
        self._tree = cKDTree(self.points_m)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """Nearest points of the curve to points (N, 3), and the tangents there, (N, 3) each."""
        run = self.run_m[self._tree.query(points)[1]]
        for _ in range(2):
            along = self._by_run(run, 1)
            run = run + ((points - self._by_run(run)) * along).sum(axis=1)
            run = np.clip(run, 0.0, self.run_m[-1])
        along = self._by_run(run, 1)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return np.asarray(self._by_run(run)), np.asarray(along)
