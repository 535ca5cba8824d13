"""Waves on a chain: where the joints of an axis are, and how far a wave of headings bends them.

Amplitudes of gaits are *winding angles*: how far the body turns away from its axis (Hirose's
alpha). They do not depend on the number of joints; these functions make joint angles of them.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from snakewalk.config.arrays import Floats

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

TURN = 2.0 * np.pi


def places(robot: "RobotConfig", joints: tuple[int, ...]) -> Floats:
    """(n,) where joints are on the body: 0 at the head's tip, 1 at the tail's end; read-only."""
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
    """Amplitude of each joint of an axis for a wave of headings of ``winding_rad``.

    A joint makes the difference of the headings half a spacing before and behind it:
    ``2 winding sin(pi waves d)`` for joints that are a share d of the body apart.
    """
    ends = robot.link_ends
    reach = ends[joints[-1] + 1] - ends[joints[0] + 1]
    apart = reach / max(len(joints) - 1, 1) / robot.link_count
    return 2.0 * winding_rad * float(np.sin(np.pi * min(waves * apart, 0.5)))


def travelling(
    robot: "RobotConfig", joints: tuple[int, ...], phase_rad: Floats, waves: float, lead_rad: float
) -> Floats:
    """(T, n) ``sin(phase + lead - 2 pi waves s)``: runs from head to tail as the phase grows."""
    at = TURN * waves * places(robot, joints)
    return np.asarray(np.sin(phase_rad[:, None] + lead_rad - at))


def bends_rad(robot: "RobotConfig", joints: tuple[int, ...], headings_rad: Floats) -> Floats:
    """(T, n) joint angles of the headings (T, n + 1) of the rigid groups between ``joints``."""
    return np.asarray(headings_rad[:, :-1] - headings_rad[:, 1:])


def group_places(robot: "RobotConfig", joints: tuple[int, ...]) -> Floats:
    """(n + 1,) middles of the rigid groups that ``joints`` separate, on the body as ``places``."""
    edges = np.concatenate([[0.0], places(robot, joints), [1.0]])
    return np.asarray((edges[:-1] + edges[1:]) / 2.0)
