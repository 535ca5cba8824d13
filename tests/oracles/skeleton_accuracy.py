"""How far captured skeletons are from true ones."""

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats
from snakewalk.controller.track.resample import equal_arc_length


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


def covered_error(found_px: Floats, true_px: Floats) -> float:
    """``point_error`` of the part of a line that a midline covers which ends before the tips.

    The part lies between the points nearest to the midline's ends. A line that ends before the
    midline is not extended.
    """
    fine = equal_arc_length(found_px, 1000)
    first = int(np.argmin(np.hypot(*(fine[:500] - true_px[0]).T)))
    last = 500 + int(np.argmin(np.hypot(*(fine[500:] - true_px[-1]).T)))
    return point_error(equal_arc_length(fine[first : last + 1], len(true_px) - 1), true_px)
