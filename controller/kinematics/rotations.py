"""Wrapped angles and circular means."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled, readonly_array


def wrap(angle_rad: ArrayLike) -> Floats:
    """Return angles in [-pi, pi)."""
    return (np.asarray(angle_rad, float) + np.pi) % (2.0 * np.pi) - np.pi


def offset_rad(measured_rad: Floats, believed_rad: Floats) -> float:
    """Circular mean difference of link headings (L,): the rotation from believed to measured."""
    return _mean_difference_rad(measured_rad, believed_rad)


@compiled(f"float64({readonly_array()}, {readonly_array()})")
def _mean_difference_rad(measured_rad: Floats, believed_rad: Floats) -> float:
    sine = cosine = 0.0
    for k in range(len(measured_rad)):
        sine += np.sin(measured_rad[k] - believed_rad[k])
        cosine += np.cos(measured_rad[k] - believed_rad[k])
    return float(np.arctan2(sine, cosine))
