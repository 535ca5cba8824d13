"""Where to aim: a carrot ahead on the path, and the heading error of a shape towards it."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats


class Path(Protocol):
    """A way over the ground, by arc length from its start."""

    @property
    def length_m(self) -> float:
        """Arc length of the whole path."""
        ...

    def position(self, s_m: ArrayLike) -> Floats:
        """(..., 2) points at arc lengths, clamped to the ends."""
        ...

    def follow(self, points_m: Floats, s_m: Floats, gap_m: Floats) -> None:
        """Take (n, 2) followers along from (n,) arc lengths on; writes those, and the distances."""
        ...

    def nearest(self, point_m: ArrayLike, from_s_m: float = 0.0, window_m: float = 1.5) -> float:
        """Arc length of the closest point in ``[from_s_m, from_s_m + window_m]``."""
        ...

    def first_pass(self, point_m: ArrayLike, from_s_m: float = 0.0) -> float:
        """Arc length at which the path first comes nearest to a point that it leads through."""
        ...


def aim_rad(path: Path, from_m: Floats, along_m: float, carrot_m: float) -> float:
    """Direction from a point to the carrot ``carrot_m`` beyond ``along_m`` on the path.

    The path is taken to go on straight past its end, or the last carrot would turn the body around.
    """
    at = along_m + carrot_m
    carrot = path.position(min(at, path.length_m))
    if at > path.length_m:
        before = path.position(path.length_m - 0.05)
        step = carrot - before
        carrot = carrot + step / max(float(np.hypot(*step)), 1e-9) * (at - path.length_m)
    return float(np.arctan2(carrot[1] - from_m[1], carrot[0] - from_m[0]))
