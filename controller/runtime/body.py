"""The body as it lies in the world: the measured head pose carried along the measured joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig
from drivers.types import BodyPose

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BodyView:
    """Where every link is, in the world."""

    link_m: Floats
    """(L, 3) centres of the links, head first."""
    forward: Floats
    """(L, 3) unit vectors along the links, in the direction of travel."""

    @property
    def headings_rad(self) -> Floats:
        """(L,) unwrapped headings of the links in the horizontal plane."""
        return np.unwrap(np.arctan2(self.forward[:, 1], self.forward[:, 0]))

    @property
    def centre_m(self) -> Floats:
        """(3,) centre of mass of equal links; [PT] 2.6.2 calls it S_k."""
        return np.asarray(self.link_m.mean(axis=0))


def body_in_world(robot: RobotConfig, pose: BodyPose, joint_rad: Floats) -> BodyView:
    """Forward kinematics from the head pose and joint angles (J,).

    Yaw turns the link behind by ``-q`` about the up axis, pitch by ``+q`` about the left axis, so a
    positive joint bends the head side to the left, or lifts it.
    """
    half = 0.5 * robot.link_length_m
    links = robot.joint_count + 1
    centres = np.empty((links, 3))
    forward = np.empty((links, 3))
    rotation = np.array(pose.rotation, dtype=float)
    centre = np.array(pose.head_in_world_m, dtype=float)
    cos, sin = np.cos(joint_rad), np.sin(joint_rad)
    centres[0], forward[0] = centre, rotation[:, 0]
    for j, axis in enumerate(robot.joint_axes):
        joint_m = centre - half * rotation[:, 0]
        c, s = cos[j], sin[j]
        if axis == "y":
            turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        else:
            turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        rotation = rotation @ turn
        centre = joint_m - half * rotation[:, 0]
        centres[j + 1], forward[j + 1] = centre, rotation[:, 0]
    return BodyView(centres, forward)
