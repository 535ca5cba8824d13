"""From the pose of a tracked body to that of the head link."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.pose.sample import PoseSample, turned
from snakewalk.drivers.types import BodyPose

LEAST_SD_M, LEAST_SD_RAD = 1e-3, 2e-3
"""No source is believed to be more accurate (ours)."""


@dataclass(frozen=True, slots=True)
class HeadMeasurement:
    """Pose of the head link in the world, measured."""

    position_m: Floats
    """(3,) position of the head link in the world, m."""
    rotation: Floats
    """(3, 3) axes of the head link in the world, in columns."""
    position_covariance: Floats
    """(3, 3) m^2"""
    rotation_covariance: Floats
    """(3, 3) rad^2, of rotations about the world's axes."""


def tracked_link(sample: PoseSample, config: PoseConfig) -> tuple[Floats, Floats]:
    """Return centre (3,) and axes (3, 3) of the link that carries the tracked body."""
    world = turned(config.world_deg)
    axes = world @ sample.rotation @ turned(config.offset_deg).T
    body_m = np.array(config.world_m) + config.scale * (world @ sample.position_m)
    return body_m - axes @ np.array(config.offset_m), axes


class TrackedBody:
    """The body that a source tracks, on a link of the robot."""

    def __init__(self, robot: RobotConfig, config: PoseConfig) -> None:
        self._spine = SpineLinks.of(robot)
        self._config = config
        self._world_m = np.array(config.world_m)
        self._world = turned(config.world_deg)

    def head(
        self, sample: PoseSample, joint_rad: Floats, unknown_rad: float = 0.0
    ) -> HeadMeasurement:
        """Return the head's pose for joint angles (J,) at the time of the sample.

        ``unknown_rad`` is a standard deviation of its turn, in addition to that of the sample.
        """
        link_m, link = tracked_link(sample, self._config)
        joint_in_head, link_in_head = self._in_head(joint_rad)
        rotation = link @ link_in_head.T
        head_m = link_m - rotation @ joint_in_head
        position, turn = self._covariances(sample)
        turn = turn + unknown_rad**2 * np.eye(3)
        body_m = link_m + link @ np.array(self._config.offset_m)
        # an angle error moves the head by the lever arm
        arm = np.cross(head_m - body_m, np.eye(3))
        return HeadMeasurement(head_m, rotation, position + arm @ turn @ arm.T, turn)

    def body(self, head: BodyPose, joint_rad: Floats) -> tuple[Floats, Floats]:
        """Return position (3,) and axes (3, 3) of the tracked body in the source's frame."""
        joint_in_head, link_in_head = self._in_head(joint_rad)
        link = head.rotation @ link_in_head
        link_m = head.head_in_world_m + head.rotation @ joint_in_head
        config = self._config
        from_origin_m = link_m + link @ np.array(config.offset_m) - self._world_m
        axes = link @ turned(config.offset_deg)
        return self._world.T @ from_origin_m / config.scale, self._world.T @ axes

    def _in_head(self, joint_rad: Floats) -> tuple[Floats, Floats]:
        view = self._spine.in_world(BodyPose(0.0, np.zeros(3), np.eye(3)), joint_rad)
        return view.link_m[self._config.link], view.rotation[self._config.link]

    def _covariances(self, sample: PoseSample) -> tuple[Floats, Floats]:
        if sample.covariance is None:
            noise_rad = float(np.radians(self._config.noise_deg))
            return self._config.noise_m**2 * np.eye(3), noise_rad**2 * np.eye(3)
        position = sample.covariance[:3, :3]
        turn = sample.covariance[3:, 3:]
        world = self._world
        return (
            world @ position @ world.T + LEAST_SD_M**2 * np.eye(3),
            world @ turn @ world.T + LEAST_SD_RAD**2 * np.eye(3),
        )
