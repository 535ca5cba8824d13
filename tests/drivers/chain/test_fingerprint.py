"""What a changed register of a fingerprint does to a joint, in words."""

import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.chain.fingerprint import (
    FINGERPRINT,
    fingerprint_faults,
    fingerprint_of,
    register_change,
)

UNIT_RAD = 0.0015


def test_a_fingerprint_has_its_registers_only_and_those_that_a_model_has() -> None:
    registers = {"Homing Offset": 3, "Shutdown": 0, "Position P Gain": 800}
    facts = servo_model("XM430-W350")
    assert fingerprint_of(registers, facts) == {"Homing Offset": 3, "Shutdown": 0}
    assert set(fingerprint_of(dict.fromkeys(FINGERPRINT, 1), facts)) == set(FINGERPRINT)


@pytest.mark.parametrize("unit_rad", [UNIT_RAD, -UNIT_RAD])
def test_a_zero_is_in_radians_whatever_the_direction(unit_rad: float) -> None:
    text = register_change("Homing Offset", 10, 110, unit_rad)
    assert text == "Homing Offset is 110, was 10: its zero has moved by +0.15 rad"


@pytest.mark.parametrize(
    ("before", "now", "reverses"), [(0, 1, True), (5, 4, True), (1, 5, False), (0, 4, False)]
)
def test_a_drive_mode_reverses_by_its_lowest_bit(before: int, now: int, *, reverses: bool) -> None:
    text = register_change("Drive Mode", before, now, UNIT_RAD)
    assert text.startswith(f"Drive Mode is {now}, was {before}")
    assert ("its direction is reversed" in text) == reverses


def test_another_register_has_its_values_only() -> None:
    assert register_change("Shutdown", 52, 1, UNIT_RAD) == "Shutdown is 1, was 52"


def test_faults_name_the_joint_and_skip_what_is_the_same_or_unknown() -> None:
    robot = RobotConfig(name="some", joint_axes="yyy")
    before = {"Shutdown": 52, "Drive Mode": 0, "PWM Limit": 885}
    lines = fingerprint_faults(robot, 1, before, {"Shutdown": 0, "Drive Mode": 0}, UNIT_RAD)
    assert lines == ["joint yaw_02 (ID 2): Shutdown is 0, was 52"]
