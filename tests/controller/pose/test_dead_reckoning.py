"""Dead reckoning repeats a run whose body obeys the same friction; an IMU turns it."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import ImuConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose, ImuState, JointState

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


@pytest.mark.parametrize("link", [0, 5, 16])
def test_an_imu_in_any_link_gives_the_heads_attitude_and_its_own_north_is_taken_off(
    link: int,
) -> None:
    """The head turns by 0.8 rad and tips over by 2 rad about its own axis; the joints stay bent."""
    robot = ROBOT.model_copy(update={"imu": ImuConfig(link=link)})
    joints = 0.3 * np.sin(np.arange(16.0))
    reckon = DeadReckoning(robot, FrictionConfig(), (1.0, 2.0), 0.3, imu=True)
    north = rotation_by(np.array([0.0, 0.0, 2.5]))
    for k in range(41):
        heading = rotation_by(np.array([0.0, 0.0, 0.02 * k]))
        head = heading @ rotation_by(np.array([0.05 * k, 0.0, 0.0]))
        body = body_in_world(robot, BodyPose(0.0, np.zeros(3), head), joints)
        imu = ImuState(north @ body.rotation[link], np.zeros(3), 0.0, True)
        pose = reckon(state(0.02 * k, joints)._replace(imu=imu))
        if k == 0:
            first = pose
    mean = body_in_world(robot, first, joints).headings_rad.mean()
    np.testing.assert_allclose(mean, 0.3)
    np.testing.assert_allclose(pose.heading_rad - first.heading_rad, 0.8)
    np.testing.assert_allclose(first.rotation.T @ pose.rotation, head, atol=1e-12)


def test_without_a_reading_it_goes_on_from_the_joints() -> None:
    robot = ROBOT.model_copy(update={"imu": ImuConfig()})
    plain = DeadReckoning(ROBOT, FrictionConfig(), (0.0, 0.0), 0.0)
    blind = DeadReckoning(robot, FrictionConfig(), (0.0, 0.0), 0.0, imu=True)
    for k in range(10):
        now = state(0.02 * k, 0.5 * np.sin(np.arange(16.0) - 0.3 * k))
        np.testing.assert_array_equal(plain(now).rotation, blind(now).rotation)
