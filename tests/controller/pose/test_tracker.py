"""The simulated tracker of a served robot."""

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.config.pose import PoseConfig, TrackerConfig
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.controller.pose.tracker import SimulatedTracker
from snakewalk.drivers.types import BodyPose


def test_poses_that_nobody_asks_for_are_dropped() -> None:
    """`bus serve --robot` without `--pose-out` kept each of them: 1.1 MB a minute."""
    robot = load_robot("yaw16")
    tracker = SimulatedTracker(TrackerConfig(), TrackedBody(robot, PoseConfig()))
    for cycle in range(2000):
        head = BodyPose(0.02 * cycle, np.zeros(3), np.eye(3))
        tracker.measure(head, np.zeros(robot.joint_count))
    assert len(tracker.due(40.0)) < 60
