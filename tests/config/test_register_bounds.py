"""Keys of a robot within the registers of its servos."""

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig


def robot(joints: list[dict[str, object]] | None = None, **servo: object) -> RobotConfig:
    servo = {"model": "STS3215", "supply_v": 7.4} | servo
    described: dict[str, object] = {"name": "it", "joint_axes": "ypy", "servo": servo}
    return checked(RobotConfig, described | ({"joints": joints} if joints else {}), "it.toml")


@pytest.mark.parametrize(
    ("servo", "fault"),
    [
        ({"position_p_gain": 255}, "servo: position_p_gain = 255: Position P Gain(21) of STS3215"),
        ({"pitch_p_gain": 800}, "servo: pitch_p_gain = 800: Position P Gain(21) of STS3215 holds"),
        ({"position_d_gain": 300}, "position_d_gain = 300: Position D Gain(22) of STS3215 holds"),
        (
            {"model": "XM430-W350", "supply_v": 12.0, "pitch_current_limit_a": 3.3},
            "pitch_current_limit_a = 3.3 A: Goal Current(102) of XM430-W350 holds 0 to 3.2",
        ),
    ],
)
def test_a_value_beyond_its_register_is_rejected(servo: dict[str, object], fault: str) -> None:
    with pytest.raises(ConfigError) as caught:
        robot(**servo)
    assert fault in str(caught.value)
    assert "choose a value in this range" in str(caught.value)


def test_a_joint_of_its_own_gain_is_named() -> None:
    with pytest.raises(ConfigError, match=r"joint pitch_02 \(ID 2\): position_p_gain = 400"):
        robot(joints=[{}, {"position_p_gain": 400}, {}])


def test_the_largest_value_of_a_register_is_accepted() -> None:
    assert robot(position_p_gain=254).position_p_gains == (254, 32, 254)


def test_a_default_that_a_register_cannot_hold_is_the_initial_value_of_the_register() -> None:
    assert robot().position_p_gains == (32, 32, 32)
    assert robot(model="SCS0009", supply_v=6.0).position_p_gains == (15, 15, 15)
    assert robot(model="XM430-W350", supply_v=12.0).position_p_gains == (800, 400, 800)


def test_a_range_beyond_the_position_limits_of_a_servo_is_rejected() -> None:
    with pytest.raises(ConfigError, match="leaves the servo's turn"):
        robot([{"limit_rad": 2.7}, {}, {}], model="SCS0009", supply_v=6.0)
    assert robot([{"limit_rad": 2.6}, {}, {}], model="SCS0009", supply_v=6.0).limit_rad[0] == 2.6
