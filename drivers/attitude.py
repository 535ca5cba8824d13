"""Rotations, and attitude from rates and accelerations.

A complementary filter on rotations integrates rates, and corrects roll and pitch by the
acceleration at rest. The heading drifts with the gyro's bias. Source: R. Mahony, T. Hamel, J.-M.
Pflimlin, "Nonlinear complementary filters on the special orthogonal group", IEEE Transactions on
Automatic Control 53, 2008, without its bias estimate.
"""

from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2

CORRECTION_1_S = 0.5
"""Rate of the correction of the up direction (ours): an error falls to a third in two seconds."""
_REST_TOLERANCE = 0.15
"""Largest relative difference from gravity of a force that shows the direction up (ours)."""
_LONGEST_PAUSE_S = 0.2
"""Longest pause between readings that a correction counts, s (ours)."""


def rotations() -> Any:
    """Return scipy's class of rotations, for programs with an IMU."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415  a light install has no scipy

    return Rotation


def rotation_by(vector: Floats) -> Floats:
    """(3, 3) rotation about ``vector`` by its length."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def heading_of(rotation: Floats) -> float:
    """Return the direction of a frame's x axis in the horizontal plane, rad, in (-pi, pi]."""
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def about_up(angle_rad: float) -> Floats:
    """(3, 3) rotation about the up axis."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class AttitudeFilter:
    """Axes of a device in the world; the heading begins at 0."""

    def __init__(self) -> None:
        self._rotation: Floats | None = None

    def update(self, rate_rad_s: Floats, force_m_s2: Floats, step_s: float) -> Floats:
        """Process a reading, ``step_s`` after the last; return the axes (3, 3), columns.

        ``rate_rad_s`` (3,) is the mean rate since the last reading and ``force_m_s2`` (3,) the
        specific force (up at rest), both in the device's axes. The first reading ignores
        ``step_s``.
        """
        size = float(np.linalg.norm(force_m_s2))
        still = abs(size - GRAVITY_M_S2) <= _REST_TOLERANCE * GRAVITY_M_S2
        if self._rotation is None:
            self._rotation = _level_axes(force_m_s2 / size) if size > 0.0 else np.eye(3)
            return self._rotation
        turned = self._rotation @ rotation_by(rate_rad_s * step_s)
        if still:
            up = turned[2]  # the world's up in the device's axes
            error = np.cross(force_m_s2 / size, up)
            share = CORRECTION_1_S * min(step_s, _LONGEST_PAUSE_S)
            turned = turned @ rotation_by(error * share)
        self._rotation = np.asarray(turned)
        return self._rotation


def _level_axes(up: Floats) -> Floats:
    """Axes, columns, of a device with ``up`` (3,) in its own axes; its x is at heading 0."""
    ahead = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 0.0, -up[0]])
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left)
    return np.array([np.cross(left, up), left, up])
