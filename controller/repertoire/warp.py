"""Motion warping between segments ([YT] 4.2): as many frames as the tail's way asks for."""

import math

import numpy as np

from snakewalk.config.arrays import Floats


def tip_way_m(before_m: Floats, after_m: Floats) -> float:
    """How far the tail goes in the body frame between shapes (L, 3)."""
    return float(np.linalg.norm(after_m[-1] - before_m[-1]))


def bridge_frames(way_m: float, largest_m: float) -> int:
    """Return the frames between two shapes, so that no step of the tip is over ``largest_m``.

    n frames make n + 1 steps, so n is the least for which ``way / (n + 1) <= largest``.

    Raises:
        ValueError: ``largest_m`` is not positive.

    """
    if largest_m <= 0.0:
        raise ValueError("the largest way of the tip must be over 0")
    return max(0, math.ceil(way_m / largest_m - 1e-9) - 1)


def bridge(before_m: Floats, after_m: Floats, largest_m: float) -> Floats:
    """(n, L, 3) shapes linear between ``before_m`` and ``after_m`` (L, 3), both left out."""
    count = bridge_frames(tip_way_m(before_m, after_m), largest_m)
    share = np.arange(1, count + 1) / (count + 1.0)
    return np.asarray(before_m + share[:, None, None] * (after_m - before_m))
