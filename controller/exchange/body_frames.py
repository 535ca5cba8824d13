"""Coordinate frames of all links during a run, named as by ``robot export``.

The frame of ``link0``, the head, is at its centre; that of another link at the joint in front, as
in a URDF. x is forward, y left, z up.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.runlog.record import RunRecord

WORLD = "world"
"""Name of the frame of the head's pose."""


@dataclass(frozen=True, slots=True)
class BodyFrames:
    """Frames of all links, each in the one that it hangs on; the head's in the world."""

    time_s: Floats
    """(T,) times of the frames, s."""
    names: tuple[str, ...]
    """L names, head first; the segments of legs behind the spine, in the order of the bus."""
    parents: tuple[str, ...]
    """L names."""
    translation_m: Floats
    """(T, L, 3) positions of the links in their parents' frames, m."""
    quaternion: Floats
    """(T, L, 4) as x, y, z, w."""


def body_frames(record: RunRecord) -> BodyFrames:
    """Frames at every pose of a log; where no pose was logged, at every cycle, head at the origin.

    Joint angles between two cycles are interpolated; a joint that was never read is straight.
    """
    robot = record.header.robot
    pose = record.pose
    cycle = record.cycle
    is_known = np.isfinite(pose.head_m).all(axis=1) & np.isfinite(pose.rotation).all(axis=(1, 2))
    if is_known.any():
        time_s = pose.time_s[is_known]
        head_m = pose.head_m[is_known]
        turn = pose.rotation[is_known]
    else:
        time_s = cycle.time_s
        head_m = np.zeros((len(time_s), 3))
        turn = np.tile(np.eye(3), (len(time_s), 1, 1))
    count = robot.joint_count + 1
    translation = np.zeros((len(time_s), count, 3))
    quaternion = np.zeros((len(time_s), count, 4))
    translation[:, 0], quaternion[:, 0] = head_m, Rotation.from_matrix(turn).as_quat()
    for joint, (at_m, axis) in enumerate(_joints(robot)):
        half_rad = 0.5 * _angles_at(time_s, cycle.time_s, cycle.measured_rad[:, joint])
        translation[:, joint + 1] = at_m
        quaternion[:, joint + 1, 3] = np.cos(half_rad)
        quaternion[:, joint + 1, :3] = np.sin(half_rad)[:, None] * axis
    names = tuple(f"link{k}" for k in range(count))
    parents = tuple(WORLD if k < 0 else names[k] for k in robot.link_parents)
    return BodyFrames(time_s, names, parents, translation, quaternion)


def _joints(robot: RobotConfig) -> Iterator[tuple[Floats, Floats]]:
    """Where each joint is in the frame of the link before it, and its axis; spine, then legs."""
    lengths_m = robot.link_lengths_m
    for long_m, letter in zip(
        (0.5 * lengths_m[0], *lengths_m[1:-1]), robot.joint_axes, strict=True
    ):
        axis = (0.0, 0.0, -1.0) if letter == "y" else (0.0, 1.0, 0.0)
        yield np.array([-long_m, 0.0, 0.0]), np.array(axis)
    for joint in robot.limb_joints:
        pair = robot.limbs[joint.pair]
        side = joint.outward
        if joint.place:
            at_m = (0.0, side * pair.segments_m[joint.place - 1], 0.0)
        else:
            back_m = 0.5 * lengths_m[pair.link] if pair.link else 0.0
            at_m = (-back_m, side * pair.hip_m, 0.0)
        swings = pair.joint_axes[joint.place] == "y"
        yield np.array(at_m), np.array((0.0, 0.0, -side) if swings else (side, 0.0, 0.0))


def _angles_at(time_s: Floats, sampled_s: Floats, angle_rad: Floats) -> Floats:
    """(T,) angle at other times; zero where it is never known."""
    is_known = np.isfinite(angle_rad)
    if not is_known.any():
        return np.zeros(len(time_s))
    return np.interp(time_s, sampled_s[is_known], angle_rad[is_known])
