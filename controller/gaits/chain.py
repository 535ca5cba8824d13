"""A chain of links in space: where its joints are, and how they move with head and angles."""

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig

Floats = NDArray[np.float64]


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


def rotation_by(vector: Floats) -> Floats:
    """(3, 3) rotation about ``vector`` by its length."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)
