"""Dead reckoning repeats a run whose body obeys the same friction; a still body stays."""

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.localization.dead_reckoning import DeadReckoning
from snakewalk.drivers.types import JointState

ROBOT = load_robot("yaw16")


def state(time_s: float, joints: np.ndarray) -> JointState:
    z = np.zeros(16)
    byte = np.zeros(16, np.uint8)
    return JointState(time_s, joints, z, z, z, z, byte, byte, z, np.ones(16, bool), z)


def test_it_follows_the_forecast_from_the_joints_alone() -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid", time_limit_s=12.0)
    ahead = prepared.forecast()
    reckon = DeadReckoning(ROBOT, FrictionConfig(), (0.0, 0.0), prepared.start_heading_rad)
    for time_s, joints in zip(ahead.time_s, ahead.joint_rad, strict=True):
        pose = reckon(state(time_s, joints))
    way = np.hypot(*(ahead.centre_m[-1] - ahead.centre_m[0]))
    behind = np.hypot(*(ahead.centre_m[-1] - pose.head_in_world_m[:2]))
    assert way > 1.5
    assert behind < 0.5 * ROBOT.length_m


def test_a_body_that_holds_still_stays() -> None:
    reckon = DeadReckoning(ROBOT, FrictionConfig(), (1.0, 2.0), 0.3)
    for k in range(20):
        pose = reckon(state(0.02 * k, np.zeros(16)))
    np.testing.assert_array_equal(pose.head_in_world_m, [1.0, 2.0, 0.0])
    np.testing.assert_allclose(pose.heading_rad, 0.3)
