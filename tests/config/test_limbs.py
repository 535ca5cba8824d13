"""Robots with legs: order on the bus, names, limits, and what is refused."""

import pytest
from pydantic import ValidationError

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import LimbsConfig, RobotConfig


def test_the_salamanders_joints_are_spine_then_legs() -> None:
    robot = load_robot("salamander")
    assert robot.joint_count == len(robot.servo_ids) == len(robot.limit_rad) == 16
    assert robot.link_count == 9
    assert robot.length_m == pytest.approx(0.63)
    assert robot.mass_kg == pytest.approx(9 * 0.11 + 8 * 0.09)
    assert robot.yaw_joints == tuple(range(8))
    assert robot.all_axes == "yyyyyyyy" + "yr" * 4
    assert robot.limit_rad[7:10] == (1.5, 1.2, 1.5)
    assert robot.link_parents[8:] == (7, 5, 9, 5, 11, 1, 13, 1, 15)
    assert robot.joint_label(7) == "joint yaw_08 (ID 8)"
    assert robot.joint_label(8) == "joint left_yaw_09 (ID 9)"
    assert robot.joint_label(15) == "joint right_roll_16 (ID 16)"


def test_a_snake_is_what_it_was() -> None:
    robot = load_robot("yaw16")
    assert robot.link_count == robot.joint_count + 1 == 17
    assert robot.link_parents == tuple(range(-1, 16))
    assert robot.mass_kg == pytest.approx(17 * robot.mean_link_mass_kg)


@pytest.mark.parametrize(
    ("limbs", "said"),
    [
        ([{"link": 4}], "link 4 of 4"),
        ([{"link": 1}, {"link": 2}], "from the tail to the head"),
        ([{"link": 2}, {"link": 2}], "from the tail to the head"),
        ([{"link": 1, "joint_axes": "yrr"}], "3 lengths, one a joint, not 2"),
        ([{"link": 1, "segments_m": [0.03, 0.0]}], "over 0.002"),
        ([{"link": 1, "joint_axes": "yp"}], "joint_axes"),
    ],
)
def test_legs_that_cannot_be_are_refused_in_words(
    limbs: list[dict[str, object]], said: str
) -> None:
    with pytest.raises(ValidationError, match=said):
        RobotConfig.model_validate({"name": "mine", "joint_axes": "yyy", "limbs": limbs})


def test_ids_of_legs_count_on_the_bus() -> None:
    with pytest.raises(ValidationError, match="servo IDs would run to 255"):
        RobotConfig(
            name="mine",
            joint_axes="y" * 248,
            limbs=(LimbsConfig(link=1, joint_axes="yrr", segments_m=(0.03, 0.05, 0.05)),),
            servo={"first_id": 2},  # type: ignore[arg-type]
        )


def test_a_leg_joint_may_have_an_id_and_a_limit_of_its_own() -> None:
    joints = [{"axis": "y"}, {}, {"id": 40, "limit_rad": 0.7, "sign": -1}, {}, {}]
    robot = RobotConfig.model_validate(
        {"name": "mine", "joint_axes": "y", "joints": joints, "limbs": [{"link": 1}]}
    )
    assert robot.servo_ids == (1, 2, 40, 4, 5)
    assert robot.limit_rad == (1.5, 1.2, 0.7, 1.2, 1.5)
    assert robot.current_limits_a == (float("inf"),) * 5
    with pytest.raises(ValidationError, match="3 given, but spine and legs have 5"):
        RobotConfig.model_validate(
            {"name": "mine", "joint_axes": "y", "joints": joints[:3], "limbs": [{"link": 1}]}
        )
