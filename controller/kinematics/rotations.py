"""Angles and rotations: wrapped angles, circular means, rotations about an axis."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats


def rotation_by(vector: Floats) -> Floats:
    """(3, 3) rotation about ``vector`` by its length."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def wrap(angle_rad: ArrayLike) -> Floats:
    """Angles in [-pi, pi)."""
    return np.asarray((np.asarray(angle_rad, float) + np.pi) % (2.0 * np.pi) - np.pi)


def offset_rad(measured_rad: Floats, believed_rad: Floats) -> float:
    """Rotation from believed to measured link headings: their circular mean difference."""
    return float(np.angle(np.mean(np.exp(1j * (measured_rad - believed_rad)))))
