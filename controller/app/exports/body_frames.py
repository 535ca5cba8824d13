"""Where every link's coordinate frame was during a run, with the names that ``robot export`` gives.

The frame of ``link0``, the head, is its centre; the frame of every other link is the joint in front
of it, as in a URDF. x is forward, y left, z up.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.runlog.record import RunRecord

WORLD: Final = "world"
"""The frame in which the head's pose is told."""


@dataclass(frozen=True, slots=True)
class BodyFrames:
    """Frames of the spine's links, each in the one before it; the head's in the world. No legs."""

    time_s: Floats
    """(T,)"""
    names: tuple[str, ...]
    """L names, head first."""
    parents: tuple[str, ...]
    """L names."""
    translation_m: Floats
    """(T, L, 3)"""
    quaternion: Floats
    """(T, L, 4) as x, y, z, w."""


def joint_names(robot: RobotConfig) -> tuple[str, ...]:
    """Names of all joints: ``joint0`` is next to the head."""
    return tuple(f"joint{k}" for k in range(robot.joint_count))


def body_frames(record: RunRecord) -> BodyFrames:
    """Frames at every pose of a log; where no pose was logged, at every cycle, head at the origin.

    Joint angles between two cycles are interpolated; a joint that was never read is straight.
    """
    robot, pose, cycle = record.header.robot, record.pose, record.cycle
    known = np.isfinite(pose.head_m).all(axis=1) & np.isfinite(pose.rotation).all(axis=(1, 2))
    if known.any():
        time_s, head_m, turn = pose.time_s[known], pose.head_m[known], pose.rotation[known]
    else:
        time_s = cycle.time_s
        head_m, turn = np.zeros((len(time_s), 3)), np.tile(np.eye(3), (len(time_s), 1, 1))
    count = robot.link_count
    translation = np.zeros((len(time_s), count, 3))
    quaternion = np.zeros((len(time_s), count, 4))
    translation[:, 0], quaternion[:, 0] = head_m, Rotation.from_matrix(turn).as_quat()
    lengths_m = robot.link_lengths_m
    translation[:, 1:, 0] = -np.array([0.5 * lengths_m[0], *lengths_m[1:-1]])
    for joint, axis in enumerate(robot.joint_axes):
        half_rad = 0.5 * _at(time_s, cycle.time_s, cycle.measured_rad[:, joint])
        quaternion[:, joint + 1, 3] = np.cos(half_rad)
        if axis == "y":
            quaternion[:, joint + 1, 2] = -np.sin(half_rad)
        else:
            quaternion[:, joint + 1, 1] = np.sin(half_rad)
    names = tuple(f"link{k}" for k in range(count))
    return BodyFrames(time_s, names, (WORLD, *names[:-1]), translation, quaternion)


def _at(time_s: Floats, sampled_s: Floats, angle_rad: Floats) -> Floats:
    """(T,) angle at other times; zero where it is never known."""
    known = np.isfinite(angle_rad)
    if not known.any():
        return np.zeros(len(time_s))
    return np.interp(time_s, sampled_s[known], angle_rad[known])
