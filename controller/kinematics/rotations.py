"""Angles: wrapped, and their circular means."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats


def wrap(angle_rad: ArrayLike) -> Floats:
    """Angles in [-pi, pi)."""
    return np.asarray((np.asarray(angle_rad, float) + np.pi) % (2.0 * np.pi) - np.pi)


def offset_rad(measured_rad: Floats, believed_rad: Floats) -> float:
    """Rotation from believed to measured link headings: their circular mean difference."""
    return float(np.angle(np.mean(np.exp(1j * (measured_rad - believed_rad)))))
