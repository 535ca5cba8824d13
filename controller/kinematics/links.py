"""The body as it lies in the world: the measured head pose carried along the measured joints."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.compiling import compiled, seen
from snakewalk.drivers.types import BodyPose


class BodyView(NamedTuple):
    """Where every link is, in the world."""

    link_m: Floats
    """(L, 3) centres of the links, head first."""
    forward: Floats
    """(L, 3) unit vectors along the links, in the direction of travel."""
    centre_m: Floats
    """(3,) centre of mass of equal links; [PT] 2.6.2 calls it S_k."""

    @property
    def headings_rad(self) -> Floats:
        """(L,) unwrapped headings of the links in the horizontal plane."""
        angles = np.arctan2(self.forward[:, 1], self.forward[:, 0])
        turns = np.rint(
            (angles[1:] - angles[:-1]) / (2.0 * np.pi)
        )  # np.unwrap takes 4 times longer
        angles[1:] -= 2.0 * np.pi * turns.cumsum()
        return np.asarray(angles)

    def way_since_m(self, before: "BodyView") -> float:
        """How far the links have gone along themselves since ``before``, mean over the body."""
        way_m = (self.link_m - before.link_m).ravel().dot(self.forward.ravel())
        return float(way_m) / len(self.link_m)


def body_in_world(robot: RobotConfig, pose: BodyPose, joint_rad: Floats) -> BodyView:
    """Forward kinematics from the head pose and joint angles (J,).

    Yaw turns the link behind by ``-q`` about the up axis, pitch by ``+q`` about the left axis, so a
    positive joint bends the head side to the left, or lifts it.
    """
    links = len(joint_rad) + 1
    forward, placed = np.empty((links, 3)), np.empty((links + 1, 3))
    yaws = _yaws(robot.joint_axes)
    link_m = robot.link_length_m
    _carry(yaws, pose.rotation, pose.head_in_world_m, joint_rad, link_m, forward, placed)
    return BodyView(placed[:-1], forward, placed[-1])


@cache
def _yaws(joint_axes: str) -> NDArray[np.bool_]:
    """(J,) whether a joint is a yaw joint."""
    return np.array([axis == "y" for axis in joint_axes])


@compiled(
    f"void(boolean[::1], {seen(dimensions=2)}, {seen()}, {seen()}, float64,"
    " float64[:, ::1], float64[:, ::1])"
)
def _carry(
    yaws: NDArray[np.bool_],
    rotation: Floats,
    head_m: Floats,
    joint_rad: Floats,
    link_m: float,
    forward: Floats,
    placed: Floats,
) -> None:
    """Carry the head's axes along the joints into ``forward`` (L, 3) and ``placed`` (L + 1, 3).

    ``placed`` is the centres of the links and, last, their mean.
    """
    links = len(forward)
    fx, fy, fz = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    lx, ly, lz = rotation[0, 1], rotation[1, 1], rotation[2, 1]
    ux, uy, uz = rotation[0, 2], rotation[1, 2], rotation[2, 2]
    x, y, z = head_m[0], head_m[1], head_m[2]
    sum_x, sum_y, sum_z = x, y, z
    forward[0, 0], forward[0, 1], forward[0, 2] = fx, fy, fz
    placed[0, 0], placed[0, 1], placed[0, 2] = x, y, z
    half_m = 0.5 * link_m
    for k in range(1, links):
        x, y, z = x - half_m * fx, y - half_m * fy, z - half_m * fz
        c, s = np.cos(joint_rad[k - 1]), np.sin(joint_rad[k - 1])
        if yaws[k - 1]:
            fx, lx = c * fx - s * lx, s * fx + c * lx
            fy, ly = c * fy - s * ly, s * fy + c * ly
            fz, lz = c * fz - s * lz, s * fz + c * lz
        else:
            fx, ux = c * fx - s * ux, s * fx + c * ux
            fy, uy = c * fy - s * uy, s * fy + c * uy
            fz, uz = c * fz - s * uz, s * fz + c * uz
        x, y, z = x - half_m * fx, y - half_m * fy, z - half_m * fz
        forward[k, 0], forward[k, 1], forward[k, 2] = fx, fy, fz
        placed[k, 0], placed[k, 1], placed[k, 2] = x, y, z
        sum_x, sum_y, sum_z = sum_x + x, sum_y + y, sum_z + z
    placed[links, 0], placed[links, 1] = sum_x / links, sum_y / links
    placed[links, 2] = sum_z / links


def pose_at(position_m: Floats, heading_rad: float, time_s: float = 0.0) -> BodyPose:
    """Build the pose of a level head link."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return BodyPose(time_s, np.append(position_m[:2], 0.0), rotation)


def mean_heading_rad(robot: RobotConfig, joint_rad: Floats) -> float:
    """Mean link heading relative to the head link; a body is laid out by it, not by its head."""
    return float(body_in_world(robot, pose_at(np.zeros(2), 0.0), joint_rad).headings_rad.mean())
