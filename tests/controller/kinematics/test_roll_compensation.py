"""Roll compensation: the same shape in the world, whatever side the body lies on."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.kinematics.roll_compensation import RollCompensation, body_roll_rad
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("alternating16")
YAW = np.isin(np.arange(ROBOT.joint_count), ROBOT.yaw_joints)
BEND = np.where(YAW, 0.6 * np.sin(0.6 * np.arange(ROBOT.joint_count)), 0.0)


def rolled(roll_rad: float, goal_rad: np.ndarray = BEND) -> BodyView:
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return body_in_world(ROBOT, BodyPose(0.0, np.zeros(3), turn), goal_rad)


@pytest.mark.parametrize("roll_rad", [-2.8, -1.2, -0.3, 0.0, 0.4, 1.5, 3.1])
def test_the_roll_of_a_body_is_measured(roll_rad: float) -> None:
    straight = np.zeros(ROBOT.joint_count)
    assert body_roll_rad(rolled(roll_rad, straight)) == pytest.approx(roll_rad)


def test_a_body_that_lies_well_is_left_alone() -> None:
    compensate = RollCompensation(ROBOT)
    for roll in (0.0, 0.5, -0.9):
        assert compensate(BEND, rolled(roll, 0.0 * BEND), 0.02) is BEND


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_bends_of_a_body_on_its_side_lie_in_the_plane_that_was_meant(side: float) -> None:
    """All but the radian that is left in is taken out; what is left in tilts the shape."""
    compensate = RollCompensation(ROBOT)
    for _ in range(200):
        goal = compensate(BEND, rolled(side * 2.0, 0.0 * BEND), 0.02)
    level = rolled(0.0)
    lying = rolled(side * 1.0, goal)  # the body, turned home by what was left in
    height_m = np.ptp(lying.link_m[:, 2])
    assert height_m < 0.3 * np.ptp(level.link_m[:, 1])
    across = np.corrcoef(lying.link_m[:, 1], level.link_m[:, 1])[0, 1]
    assert across > 0.9


def test_a_whole_turn_is_forgotten() -> None:
    """A body that came home the long way is not turned back."""
    compensate, straight = RollCompensation(ROBOT), 0.0 * BEND
    for roll in np.arange(0.0, 2.0 * np.pi, 0.02):
        compensate(BEND, rolled(float(roll), straight), 0.02)
    for _ in range(100):
        compensate(BEND, rolled(0.0, straight), 0.02)
    assert compensate(BEND, rolled(0.0, straight), 0.02) is BEND
