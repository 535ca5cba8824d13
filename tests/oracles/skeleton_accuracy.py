"""How far captured skeletons are from true ones."""

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats


def distance(found_px: Floats, true_px: Floats) -> float:
    """Median distance of the true points (P, 2) from the found curve (101, 2), px."""
    fine = np.linspace(0.0, len(found_px) - 1.0, 2001)
    at = np.arange(len(found_px))
    curve = np.column_stack([np.interp(fine, at, column) for column in found_px.T])
    return float(np.median(cKDTree(curve).query(true_px)[0]))


def swapped(found_px: Floats, true_px: Floats) -> bool:
    """Whether the head is where the tail should be; both (P, 2), the same P."""
    same = np.hypot(*(found_px - true_px).T).mean()
    return bool(np.hypot(*(found_px[::-1] - true_px).T).mean() < same)


def point_error(found_px: Floats, true_px: Floats) -> float:
    """Mean distance of corresponding points, both (P, 2), the same P, px: tips count, too."""
    return float(np.hypot(*(found_px - true_px).T).mean())
