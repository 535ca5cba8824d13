"""A chain of links in space: where its joints are, and how they move with head and angles."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.rotations import rotation_by


def chain_points_m(
    robot: RobotConfig, joint_rad: Floats, head_m: Floats, head_rotation: Floats
) -> tuple[Floats, Floats]:
    """(J + 2, 3) head's tip, joints and tail's end, and (J, 3) the joints' axes, in the world.

    An axis is that about which a positive angle turns everything *behind* the joint.
    """
    points, axes = [head_m, head_m - robot.link_length_m * head_rotation[:, 0]], []
    frame = head_rotation
    for axis, angle in zip(robot.joint_axes, joint_rad, strict=True):
        about = -frame[:, 2] if axis == "y" else frame[:, 1]
        frame = rotation_by(angle * about) @ frame
        axes.append(about)
        points.append(points[-1] - robot.link_length_m * frame[:, 0])
    return np.array(points), np.array(axes)


def chain_slopes(points: Floats, axes: Floats) -> Floats:
    """(J + 2, 3, 6 + J) how the points move with the head's tip, its turn, and each joint."""
    count = len(points)
    out = np.zeros((count, 3, 6 + len(axes)))
    out[:, :, :3] = np.eye(3)
    out[:, :, 3:6] = np.cross(np.eye(3)[None], (points - points[0])[:, None]).transpose(0, 2, 1)
    for j, axis in enumerate(axes):
        behind = slice(j + 2, count)
        out[behind, :, 6 + j] = np.cross(axis, points[behind] - points[j + 1])
    return out
