"""Frames that go with the body: the head's, and the virtual chassis.

A link of a snake swings to and fro; the virtual chassis (D. Rollinson, H. Choset, Virtual Chassis
for Snake Robots, IROS 2011) does not: its origin is the centre of mass, its axes are the principal
axes of the links, with signs that follow the body and never jump.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.drivers.types import BodyPose

_FLAT = 0.02
"""Spreads that differ by less than this share of the body's are taken for equal: no axis there."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A place and three axes in the world."""

    origin_m: Floats
    """(3,)"""
    rotation: Floats
    """(3, 3) columns: forward, left and up."""

    @property
    def heading_rad(self) -> float:
        """Direction of the forward axis in the horizontal plane, rad, in (-pi, pi]."""
        return float(np.arctan2(self.rotation[1, 0], self.rotation[0, 0]))

    def inside(self, points_m: Floats) -> Floats:
        """(..., 3) points of the world as seen from here."""
        return np.asarray((points_m - self.origin_m) @ self.rotation)

    def outside(self, points_m: Floats) -> Floats:
        """(..., 3) points of this frame in the world."""
        return np.asarray(points_m @ self.rotation.T + self.origin_m)


def head_frame(pose: BodyPose) -> Frame:
    """Return the head link's frame."""
    return Frame(np.array(pose.head_in_world_m), np.array(pose.rotation))


def virtual_chassis(link_m: Floats, up: Floats, last: Frame | None = None) -> Frame:
    """Principal axes of the body.

    Args:
        link_m: (L, 3) centres of the links, head first.
        up: (3,) a direction that goes with the body, the head link's up axis; it decides where
            the links do not: signs at the start, and a body that is straight.
        last: the chassis a moment ago, from which the signs are carried on.

    """
    centre = link_m.mean(axis=0)
    _, spread, axes = np.linalg.svd(link_m - centre)
    forward, thin = axes[0], axes[2]
    guide = link_m[0] - link_m[-1] if last is None else last.rotation[:, 0]
    forward = forward if forward @ guide >= 0.0 else -forward
    guide = up if last is None else last.rotation[:, 2]
    if spread[1] - spread[2] < _FLAT * spread[0]:
        thin = guide - (guide @ forward) * forward
        thin = thin / np.linalg.norm(thin)
    thin = thin if thin @ guide >= 0.0 else -thin
    return Frame(centre, np.stack([forward, np.cross(thin, forward), thin], axis=1))


def chassis_of_pose(
    robot: RobotConfig, pose: BodyPose, joint_rad: Floats, last: Frame | None = None
) -> Frame:
    """Return the virtual chassis in the world from a head pose and joint angles (J,)."""
    view = body_in_world(robot, pose, joint_rad)
    return virtual_chassis(view.link_m, np.asarray(pose.rotation)[:, 2], last)
