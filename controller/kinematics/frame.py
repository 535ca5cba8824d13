"""The body frame ([YT] 3.1, Eq. 1-5): origin at the body's centre, x to its head."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.drivers.attitude import about_up, heading_of

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """An origin and three axes in the world."""

    rotation: Floats
    """(3, 3) columns: forward, left, up. [YT]'s R."""
    origin_m: Floats
    """(3,) [YT]'s o."""

    @staticmethod
    def flat(x_m: float, y_m: float, heading_rad: float, z_m: float = 0.0) -> "Frame":
        """Return a level frame."""
        return Frame(rotation=about_up(heading_rad), origin_m=np.array([x_m, y_m, z_m]))

    @property
    def heading_rad(self) -> float:
        """Direction of x in the horizontal plane, in (-pi, pi]."""
        return heading_of(self.rotation)

    def to_world_m(self, points_m: Floats) -> Floats:
        """Transform points (..., 3) of this frame to the world."""
        return points_m @ self.rotation.T + self.origin_m

    def to_local_m(self, points_m: Floats) -> Floats:
        """Transform points (..., 3) of the world to this frame."""
        return (points_m - self.origin_m) @ self.rotation


def body_frame(link_m: Floats, up: ArrayLike = UP) -> Frame:
    """Frame of links with centres ``link_m`` (L, 3), head first.

    Correction to Eq. 3: y is normalised, because ``up`` is not perpendicular to x on a slope.

    Raises:
        ValueError: the head is at the centre, or x is parallel to ``up``.

    """
    origin = link_m.mean(axis=0)
    ahead = link_m[0] - origin
    length = float(np.linalg.norm(ahead))
    if length < 1e-9:
        raise ValueError("the head lies at the centre of the body: no forward axis")
    x = ahead / length
    side = np.cross(np.asarray(up, dtype=float), x)
    width = float(np.linalg.norm(side))
    if width < 1e-9:
        raise ValueError("the body stands upright: no left axis")
    y = side / width
    return Frame(rotation=np.column_stack([x, y, np.cross(x, y)]), origin_m=origin)
