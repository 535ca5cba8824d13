"""A mesh that moves with the nearest points of a surface ([GC] 2.4), as the paper has it."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats


def carry_over(mesh_m: ArrayLike, before_m: ArrayLike, after_m: ArrayLike) -> Floats:
    """(K, 3) mesh points moved with their nearest surface points ([GC] 2.4).

    Args:
        mesh_m: (K, 3) aligned with the surface.
        before_m: (..., 3) points of the surface at rest.
        after_m: the same points, moved.

    """
    mesh = np.asarray(mesh_m, float)
    rest = np.asarray(before_m, float).reshape(-1, 3)
    nearest = cKDTree(rest).query(mesh)[1]
    return np.asarray(mesh + np.asarray(after_m, float).reshape(-1, 3)[nearest] - rest[nearest])
