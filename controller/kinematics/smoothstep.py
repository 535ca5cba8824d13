"""Smoothsteps: a cubic and a quintic over x from 0 to 1, with slopes and integrals.

Both rise from 0 to their height. The cubic starts and ends at rest; the quintic also without a step
in acceleration. They do not clip x.
"""

import math
from typing import TypeVar

from snakewalk.config.arrays import Floats

Share = TypeVar("Share", float, Floats)


def cubic(x: Share, height: float = 1.0) -> Share:
    """``height (3 x^2 - 2 x^3)``."""
    return height * x * x * (3.0 - 2.0 * x)


def cubic_slope(x: Share) -> Share:
    """Slope of ``cubic`` of height 1; at most 1.5, in the middle."""
    return 6.0 * x * (1.0 - x)


def cubic_sum(x: Share) -> Share:
    """Integral of ``cubic`` of height 1 from 0 to x."""
    return x**3 - 0.5 * x**4


QUINTIC_SLOPE_MAX = 1.875
"""Largest slope of ``quintic``, in the middle."""
QUINTIC_BEND_MAX = 10.0 / math.sqrt(3.0)
"""Largest absolute slope of ``quintic_slope``."""


def quintic(x: Share) -> Share:
    """``10 x^3 - 15 x^4 + 6 x^5``."""
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def quintic_sum(x: Share) -> Share:
    """Integral of ``quintic`` from 0 to x."""
    return x**4 * (2.5 - 3.0 * x + x * x)


def quintic_slope(x: Share) -> Share:
    """Slope of ``quintic``."""
    return 30.0 * x * x * (1.0 - x) ** 2


def quintic_bend(x: Share) -> Share:
    """Slope of ``quintic_slope``."""
    return 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
