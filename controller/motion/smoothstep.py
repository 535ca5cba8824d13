"""Smooth rises over a share of time: a cubic and a quintic, their slopes and what they add up to.

Both rise from 0 at 0 to their height at 1. The cubic ``3 x^2 - 2 x^3`` begins and ends at rest; the
quintic ``10 x^3 - 15 x^4 + 6 x^5`` does so without a step in acceleration. They do not clip x.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Share = TypeVar("Share", float, NDArray[np.float64])


def cubic(x: Share, height: float = 1.0) -> Share:
    """``height (3 x^2 - 2 x^3)``."""
    return height * x * x * (3.0 - 2.0 * x)


def cubic_slope(x: Share, height: float = 1.0) -> Share:
    """Of ``cubic``; largest in the middle, 1.5 heights."""
    return height * 6.0 * x * (1.0 - x)


def cubic_sum(x: Share) -> Share:
    """Integral of ``cubic`` from 0 to x; half at 1."""
    return x**3 - 0.5 * x**4


def quintic(x: Share) -> Share:
    """``10 x^3 - 15 x^4 + 6 x^5``."""
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def quintic_slope(x: Share) -> Share:
    """Of ``quintic``; largest in the middle, 1.875."""
    return 30.0 * x * x * (1.0 - x) ** 2


def quintic_bend(x: Share) -> Share:
    """Slope of ``quintic_slope``."""
    return 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
