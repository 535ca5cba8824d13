"""One name for each joint, valid in ROS, and one text by which messages call a joint."""

import re

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.joint_names import JOINT_NAME_PATTERN
from snakewalk.config.loader import checked, digest, load_robot, load_run, load_world, shipped
from snakewalk.config.robot import JointConfig, RobotConfig


@pytest.mark.parametrize("name", shipped("robots"))
def test_default_names_are_unique_and_valid_in_ros(name: str) -> None:
    robot = load_robot(name)
    assert len(set(robot.joint_names)) == len(robot.joint_names) == robot.joint_count
    assert all(re.fullmatch(JOINT_NAME_PATTERN, each) for each in robot.joint_names)


def test_default_names_are_axis_and_place() -> None:
    assert load_robot("alternating16").joint_names[:2] == ("yaw_01", "pitch_02")
    assert load_robot("salamander").joint_names[8:12] == (
        *("left_yaw_09", "left_roll_10"),
        *("right_yaw_11", "right_roll_12"),
    )
    long = RobotConfig(name="long", joint_axes="y" * 120)
    assert (long.joint_names[0], long.joint_names[-1]) == ("yaw_001", "yaw_120")


def named(*given: str | None) -> RobotConfig:
    keys = {
        "name": "x",
        "joint_axes": "yp",
        "joints": [{} if n is None else {"name": n} for n in given],
    }
    return checked(RobotConfig, keys, "x.toml")


def test_a_robot_file_names_joints() -> None:
    robot = named("neck", None)
    assert robot.joint_names == ("neck", "pitch_02")
    assert robot.joint_label(0) == robot.label_of_servo(1) == "joint neck (ID 1)"


@pytest.mark.parametrize("bad", ["", "3rd", "left hip", "a-b", "a/b", "näck", "neck\n"])
def test_a_name_that_ros_rejects_is_refused(bad: str) -> None:
    with pytest.raises(ConfigError):
        named(bad, None)


@pytest.mark.parametrize("pair", [("neck", "neck"), ("pitch_02", None)])
def test_two_joints_with_one_name_are_refused(pair: tuple[str, str | None]) -> None:
    with pytest.raises(ConfigError, match="is the name of two joints; names must differ"):
        named(*pair)


def test_a_name_that_is_not_set_leaves_the_bytes_of_a_robot() -> None:
    robot = RobotConfig(
        name="x", joint_axes="yy", joints=(JointConfig(limit_rad=0.4), JointConfig(limit_rad=0.5))
    )
    assert "name" not in robot.model_dump(mode="json")["joints"][0]
    assert '"joints":[{"axis"' in robot.model_dump_json()
    given = robot.model_copy(update={"joints": (JointConfig(id=4, name="neck"), JointConfig())})
    assert given.model_dump(mode="json")["joints"][0]["name"] == "neck"
    back = RobotConfig.model_validate_json(given.model_dump_json())
    assert back.joint_names == given.joint_names
    run, world = load_run("flat-square"), load_world("flat")
    assert digest(run, robot, world) != digest(run, given, world)
