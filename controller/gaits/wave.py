"""Waves on a chain: positions of joints, and joint angles for a wave of headings.

Amplitudes of gaits are *winding angles* (Hirose's alpha): the turn of the body away from its axis.
They do not depend on the number of joints.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from snakewalk.config.arrays import Floats

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

TURN = 2.0 * np.pi


def places(robot: "RobotConfig", joints: tuple[int, ...]) -> Floats:
    """(n,) positions of joints: 0 at the head's tip, 1 at the tail's end; read-only."""
    return _places(robot.link_ends, joints)


@lru_cache(maxsize=64)
def _places(link_ends: tuple[float, ...], joints: tuple[int, ...]) -> Floats:
    ends = np.array(link_ends)
    shares = np.asarray(ends[np.array(joints, dtype=int) + 1] / (len(ends) - 1))
    shares.setflags(write=False)
    return shares


def joint_amplitude_rad(
    robot: "RobotConfig", joints: tuple[int, ...], winding_rad: float, waves: float
) -> float:
    """Amplitude of each joint for a wave of headings of ``winding_rad``.

    A joint bends by the difference of the headings half a spacing before and behind it: ``2 winding
    sin(pi waves d)`` for a spacing of d body lengths.
    """
    ends = robot.link_ends
    reach = ends[joints[-1] + 1] - ends[joints[0] + 1]
    spacing = reach / max(len(joints) - 1, 1) / robot.link_count
    return 2.0 * winding_rad * float(np.sin(np.pi * min(waves * spacing, 0.5)))


def travelling(
    robot: "RobotConfig", joints: tuple[int, ...], phase_rad: Floats, waves: float, lead_rad: float
) -> Floats:
    """(T, n) ``sin(phase + lead - 2 pi waves s)``: runs from head to tail as the phase grows."""
    phase_by_place = TURN * waves * places(robot, joints)
    return np.sin(phase_rad[:, None] + lead_rad - phase_by_place)


def bends_rad(robot: "RobotConfig", joints: tuple[int, ...], headings_rad: Floats) -> Floats:
    """(T, n) joint angles from headings (T, n + 1) of the rigid groups between ``joints``."""
    return headings_rad[:, :-1] - headings_rad[:, 1:]


def group_places(robot: "RobotConfig", joints: tuple[int, ...]) -> Floats:
    """(n + 1,) middles of the rigid groups between ``joints``, in the scale of ``places``."""
    edges = np.concatenate([[0.0], places(robot, joints), [1.0]])
    return np.asarray((edges[:-1] + edges[1:]) / 2.0)


def two_waves_rad(
    robot: "RobotConfig",
    phase_rad: Floats,
    sizes_rad: tuple[float, float],
    waves: float,
    lead_rad: float,
) -> Floats:
    """(T, J) a wave in plan and one in height that leads it by ``lead_rad``."""
    joints = np.zeros((len(phase_rad), robot.joint_count))
    axes = robot.yaw_joints, robot.pitch_joints
    for axis, size_rad, ahead_rad in zip(axes, sizes_rad, (0.0, lead_rad), strict=True):
        amplitude_rad = joint_amplitude_rad(robot, axis, size_rad, waves)
        joints[:, axis] = amplitude_rad * travelling(robot, axis, phase_rad, waves, ahead_rad)
    return joints
