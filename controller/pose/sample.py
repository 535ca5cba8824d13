"""One pose of a tracked body, as an external source measures it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.attitude import rotations

UNIT_TOLERANCE = 0.02
"""Largest deviation of a quaternion's length from 1 (ours)."""


class UnusablePoseError(ValueError):
    """A pose cannot be used; the text says why, and what to do."""


@dataclass(frozen=True, slots=True)
class PoseSample:
    """A pose of the tracked body in the frame of its source."""

    sequence: int
    """Number of the pose; the source counts up."""
    time_s: float
    """Time of the measurement on the clock of the source."""
    position_m: Floats
    """(3,) origin of the body."""
    rotation: Floats
    """(3, 3) columns: axes of the body."""
    frame: str
    """Name of the frame."""
    covariance: Floats | None = None
    """(6, 6) of x, y, z (m) and of the rotations about the frame's x, y, z (rad); None: unknown."""


@dataclass(frozen=True, slots=True)
class ArrivedPose:
    """A pose, or a message that contains none, with its arrival."""

    arrival_s: float
    """Time of arrival on the clock of the run."""
    sender: str
    """Address of the sender, for messages."""
    sample: PoseSample | UnusablePoseError

    @property
    def host(self) -> str:
        """Address of the sender without its port."""
        return self.sender.rpartition(":")[0]


class PoseFeed(Protocol):
    """Where poses of a source arrive."""

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses that have arrived since the last call; returns at once."""
        ...


def rotation_of(quaternion_wxyz: Sequence[float]) -> Floats:
    """Return the rotation matrix (3, 3) of a quaternion of nearly unit length.

    Raises:
        UnusablePoseError: its length is far from 1.

    """
    w, x, y, z = quaternion_wxyz
    length = float(np.linalg.norm(quaternion_wxyz))
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        raise UnusablePoseError(
            f"quaternion of length {length:.3g}: must be 1; send w, x, y, z, and no angles in "
            "degrees"
        )
    return np.asarray(rotations().from_quat([x, y, z, w]).as_matrix())


def quaternion_of(rotation: Floats) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z), w >= 0, of a rotation matrix (3, 3)."""
    x, y, z, w = rotations().from_matrix(rotation).as_quat(canonical=True).tolist()
    return w, x, y, z


def turned(roll_pitch_yaw_deg: Sequence[float]) -> Floats:
    """Return the rotation (3, 3) by roll, pitch and yaw about fixed axes, in this order."""
    turn = rotations().from_euler("xyz", list(roll_pitch_yaw_deg), degrees=True)
    return np.asarray(turn.as_matrix())
