"""Forward kinematics: the links of the spine in the world, from the head's pose and the joints."""

from functools import cache
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.attitude import about_up
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.types import BodyPose


class BodyView(NamedTuple):
    """Poses of the links of the spine in the world."""

    link_m: Floats
    """(L, 3) centres of the links, head first."""
    rotation: Floats
    """(L, 3, 3) axes of the links; columns: forward (in the direction of travel), left and up."""
    centre_m: Floats
    """(3,) centre of mass of the spine, without legs; [PT] 2.6.2 calls it S_k."""

    @property
    def forward(self) -> Floats:
        """(L, 3) unit vectors along the links, in the direction of travel."""
        return self.rotation[:, :, 0]

    @property
    def headings_rad(self) -> Floats:
        """(L,) unwrapped headings of the links in the horizontal plane."""
        angles = np.arctan2(self.rotation[:, 1, 0], self.rotation[:, 0, 0])
        turns = np.rint((angles[1:] - angles[:-1]) / (2.0 * np.pi))  # np.unwrap is 4 times slower
        angles[1:] -= 2.0 * np.pi * turns.cumsum()
        return angles

    @property
    def heading_rad(self) -> float:
        """Mean of the links' headings."""
        return float(self.headings_rad.mean())

    def advance_since_m(self, before: "BodyView") -> float:
        """Mean distance that the links moved along their present axes since ``before``."""
        return _mean_advance_m(before.link_m, self.link_m, self.rotation)

    def unbiased_advance_since_m(self, before: "BodyView") -> float:
        """Mean distance that the links moved along the mean of their axes before and now.

        Noise of the head's rotation moves the links and turns their axes at once. With the axes of
        one time only, 3 degrees of noise make a body of 1.2 m appear 0.13 m/s slower at 50 Hz.
        """
        return 0.5 * (self.advance_since_m(before) - before.advance_since_m(self))


class SpineLinks(NamedTuple):
    """Link constants of a spine, for callers that need poses in every cycle."""

    yaws: Bools
    """(L - 1,) whether a joint is a yaw joint."""
    half_m: Floats
    """(L,) half the length of each link."""
    weight: Floats
    """(L,) mass of each link over the head's: exactly 1 if all are alike."""

    @staticmethod
    def of(robot: RobotConfig) -> "SpineLinks":
        """Return the constants of a robot's spine."""
        return _spine(robot.joint_axes, robot.link_lengths_m, robot.link_masses_kg)

    def in_world(self, pose: BodyPose, joint_rad: Floats) -> BodyView:
        """See ``body_in_world``."""
        yaws, half_m, weight = self
        links = len(half_m)
        rotation = np.empty((links, 3, 3))
        centres = np.empty((links + 1, 3))
        _forward(
            yaws,
            pose.rotation,
            pose.head_in_world_m,
            joint_rad[: links - 1],
            half_m,
            weight,
            rotation,
            centres,
        )
        return BodyView(centres[:-1], rotation, centres[-1])


def body_in_world(robot: RobotConfig, pose: BodyPose, joint_rad: Floats) -> BodyView:
    """Return the spine's links from the head pose and joint angles (J,).

    Yaw turns the link behind by ``-q`` about the up axis, pitch by ``+q`` about the left axis. A
    positive joint therefore bends the head side to the left, or lifts it.
    """
    return SpineLinks.of(robot).in_world(pose, joint_rad)


def chain_angles_rad(robot: RobotConfig, body: BodyView) -> Floats:
    """(J,) angles of the spine's joints, in (-pi, pi]: the inverse of ``body_in_world``."""
    ahead, behind = body.rotation[:-1], body.forward[1:]
    side = np.where(SpineLinks.of(robot).yaws[:, None], ahead[:, :, 1], ahead[:, :, 2])
    sine = (behind * side).sum(axis=1)
    cosine = (behind * ahead[:, :, 0]).sum(axis=1)
    return np.asarray(np.arctan2(-sine, cosine))


def chain_points_m(robot: RobotConfig, body: BodyView) -> Floats:
    """(J + 2, 3) points: the head's tip, the joints, the tail's end."""
    half = half_lengths_m(robot)[:, None] * body.forward
    return np.concatenate([body.link_m[:1] + half[:1], body.link_m - half])


def half_lengths_m(robot: RobotConfig) -> Floats:
    """(L,) half the length of each link."""
    return SpineLinks.of(robot).half_m


def link_weights(robot: RobotConfig) -> Floats:
    """(L,) mass of each link of the spine over the mean link mass."""
    weight = SpineLinks.of(robot).weight
    return np.asarray(weight * (len(weight) / weight.sum()))


def chain_axes(robot: RobotConfig, body: BodyView) -> Floats:
    """(J, 3) unit axes about which a positive angle turns the links *behind* each joint."""
    left, up = body.rotation[:-1, :, 1], body.rotation[:-1, :, 2]
    return np.where(SpineLinks.of(robot).yaws[:, None], -up, left)


def chain_jacobian(points_m: Floats, axes: Floats) -> Floats:
    """(J + 2, 3, 6 + J) derivatives of the points by the head tip's position, its turn, each joint.

    Args:
        points_m: (J + 2, 3) from ``chain_points_m``.
        axes: (J, 3) from ``chain_axes``.

    """
    count = len(points_m)
    out = np.zeros((count, 3, 6 + len(axes)))
    out[:, :, :3] = np.eye(3)
    out[:, :, 3:6] = np.cross(np.eye(3)[None], (points_m - points_m[0])[:, None]).transpose(0, 2, 1)
    for j, axis in enumerate(axes):
        behind = slice(j + 2, count)
        out[behind, :, 6 + j] = np.cross(axis, points_m[behind] - points_m[j + 1])
    return out


@cache
def _spine(
    joint_axes: str, lengths_m: tuple[float, ...], masses_kg: tuple[float, ...]
) -> SpineLinks:
    yaws = np.array([axis == "y" for axis in joint_axes])
    spine = SpineLinks(yaws, 0.5 * np.array(lengths_m), np.array(masses_kg) / masses_kg[0])
    for array in spine:
        array.flags.writeable = False
    return spine


@compiled(
    f"void({readonly_array('boolean')}, {readonly_array(dimensions=2)}, {readonly_array()},"
    f" {readonly_array()}, {readonly_array()}, {readonly_array()}, float64[:, :, ::1],"
    " float64[:, ::1])",
    makes_arrays=False,
)
def _forward(
    yaws: Bools,
    head_rotation: Floats,
    head_m: Floats,
    joint_rad: Floats,
    half_m: Floats,
    weight: Floats,
    rotation: Floats,
    centres: Floats,
) -> None:
    """Write ``rotation`` (L, 3, 3) and ``centres`` (L + 1, 3): links, then centre of mass."""
    links = len(rotation)
    for i in range(3):
        for j in range(3):  # numba compiles the assignment of a row for four seconds
            rotation[0, i, j] = head_rotation[i, j]
    x, y, z = head_m[0], head_m[1], head_m[2]
    total_weight = weight[0]
    sum_x, sum_y, sum_z = total_weight * x, total_weight * y, total_weight * z
    centres[0, 0], centres[0, 1], centres[0, 2] = x, y, z
    for k in range(1, links):
        before = rotation[k - 1]
        frame = rotation[k]
        half = half_m[k - 1]
        x -= half * before[0, 0]
        y -= half * before[1, 0]
        z -= half * before[2, 0]
        c, s = np.cos(joint_rad[k - 1]), np.sin(joint_rad[k - 1])
        turned, kept = (1, 2) if yaws[k - 1] else (2, 1)
        for i in range(3):
            forward, side = before[i, 0], before[i, turned]
            frame[i, 0] = c * forward - s * side
            frame[i, turned] = s * forward + c * side
            frame[i, kept] = before[i, kept]
        half = half_m[k]
        x -= half * frame[0, 0]
        y -= half * frame[1, 0]
        z -= half * frame[2, 0]
        centres[k, 0], centres[k, 1], centres[k, 2] = x, y, z
        link_weight = weight[k]
        sum_x, sum_y, sum_z = (
            sum_x + link_weight * x,
            sum_y + link_weight * y,
            sum_z + link_weight * z,
        )
        total_weight += link_weight
    centres[links, 0], centres[links, 1] = sum_x / total_weight, sum_y / total_weight
    centres[links, 2] = sum_z / total_weight


def pose_at(position_m: Floats, heading_rad: float, time_s: float = 0.0) -> BodyPose:
    """Return the pose of a level head link."""
    return BodyPose(time_s, np.append(position_m[:2], 0.0), about_up(heading_rad))


def mean_heading_rad(robot: RobotConfig, joint_rad: Floats) -> float:
    """Mean heading of the links relative to the head link."""
    return body_in_world(robot, pose_at(np.zeros(2), 0.0), joint_rad).heading_rad


@compiled(
    f"float64({readonly_array(dimensions=2)}, {readonly_array(dimensions=2)},"
    f" {readonly_array(dimensions=3)})",
    makes_arrays=False,
)
def _mean_advance_m(before_m: Floats, here_m: Floats, rotation: Floats) -> float:
    total = 0.0
    for k in range(len(here_m)):
        for i in range(3):
            total += (here_m[k, i] - before_m[k, i]) * rotation[k, i, 0]
    return total / len(here_m)
