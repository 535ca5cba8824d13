"""Current, velocity and position sensors that always read the same are reported, and no others."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.drivers.chain.motion_sensors import (
    BACK_RAD,
    CURRENT_READS,
    CURRENT_TRAVEL_RAD,
    LONGEST_STEP_S,
    OVER_LIMIT,
    SATURATED,
    SPEED_READS,
    MotionSensors,
)

ROBOT = RobotConfig(
    name="two",
    joint_axes="yp",
    servo=ServoConfig(pitch_p_gain=800, pitch_current_limit_a=0.5),
)
STEP_S = 0.02
READ = np.ones(2, bool)
Change = Callable[[np.ndarray], None]


def swing(
    change: Change,
    cycles: int = 200,
    *,
    amplitude_rad: float = 0.3,
    step_s: float = STEP_S,
    valid: np.ndarray = READ,
) -> list[tuple[int, str]]:
    """Lines, and the readings at which they come; two joints swing at 2.5 rad/s."""
    sensors, lines = MotionSensors(ROBOT), []
    phase = np.array([0.3, 1.1])
    for k in range(cycles):
        angle = 2.5 * k * step_s + phase
        motion = np.stack(
            [
                0.2 * np.cos(angle),
                2.5 * amplitude_rad * np.cos(angle),
                amplitude_rad * np.sin(angle),
            ]
        )
        change(motion)
        lines += [(k, line) for line in sensors.update(motion, np.zeros(2), valid, k * step_s)]
    return lines


def hold(sensor: int, value: float, joint: int = 0) -> Change:
    """A reading of one joint that is always the same."""

    def change(motion: np.ndarray) -> None:
        motion[sensor, joint] = value

    return change


def test_readings_that_agree_are_not_reported() -> None:
    assert swing(lambda motion: None, 600) == []


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("amps", [0.0, 0.4, -0.44])
def test_a_current_that_stays_the_same_while_the_joint_turns_back_is_reported_once(
    amps: float, joint: int
) -> None:
    ((k, line),) = swing(hold(0, amps, joint), 300)
    name = ROBOT.joint_label(joint)
    assert line.startswith(f"{name}: current reads {amps:.2f} A constantly")
    assert CURRENT_READS <= k < 100


def test_a_current_at_its_limit_may_stay_the_same() -> None:
    assert swing(hold(0, 0.5 * SATURATED, joint=1)) == []
    assert len(swing(hold(0, 0.5 * SATURATED, joint=0))) == 1  # a yaw joint has no limit


def test_a_constant_current_above_its_limit_is_reported() -> None:
    """The campaign's 0.5 A of a joint whose limit is 0.2 A was taken for saturation."""
    assert swing(hold(0, -0.5 * OVER_LIMIT, joint=1)) == []
    assert len(swing(hold(0, -0.51 * OVER_LIMIT, joint=1))) == 1


@pytest.mark.parametrize("speed_rad_s", [0.0, 2.4, -785.0])
def test_a_velocity_that_stays_the_same_is_reported_if_the_position_differs(
    speed_rad_s: float,
) -> None:
    ((k, line),) = swing(hold(1, speed_rad_s))
    assert "joint yaw_01 (ID 1): velocity reads" in line
    assert SPEED_READS <= k < 50


def test_a_position_that_stays_the_same_is_reported_if_the_velocity_is_not_zero() -> None:
    ((_, line),) = swing(hold(2, 0.1))
    assert "joint yaw_01 (ID 1): position reads 0.10 rad constantly" in line


def test_a_frozen_servo_is_reported_once() -> None:
    def frozen(motion: np.ndarray) -> None:
        motion[:, 0] = 0.1, -0.3, 0.2

    ((_, line),) = swing(frozen)
    assert "position reads 0.20 rad constantly" in line


def test_a_joint_at_rest_is_not_reported() -> None:
    def rest(motion: np.ndarray) -> None:
        motion[:] = np.array([[0.1, 0.1], [0.0, 0.0], [0.2, 0.2]])

    assert swing(rest, 200) == []


def test_a_constant_speed_with_its_constant_current_is_not_reported() -> None:
    """A simulated joint that slews has both."""
    sensors = MotionSensors(ROBOT)
    for k in range(300):
        motion = np.array([[0.1, 0.1], [0.5, 0.5], [0.5 * k * STEP_S, 0.5 * k * STEP_S]])
        assert sensors.update(motion, np.zeros(2), READ, k * STEP_S) == []


def test_unread_unknown_and_rare_readings_are_not_judged() -> None:
    assert swing(hold(0, 0.1), valid=np.zeros(2, bool)) == []
    assert swing(hold(0, np.nan)) == []
    assert swing(hold(1, 0.0), step_s=LONGEST_STEP_S + 0.01) == []


def test_the_travel_of_a_constant_current_must_suffice() -> None:
    least_rad = min(CURRENT_TRAVEL_RAD, 2.0 * BACK_RAD)
    assert swing(hold(0, 0.1), 126, amplitude_rad=least_rad / 8) == []  # a period


def test_a_joint_that_is_not_read_hides_no_other() -> None:
    ((_, line),) = swing(hold(0, 0.0, joint=1), 300, valid=np.array([False, True]))
    assert line.startswith(ROBOT.joint_label(1))


def test_a_current_that_changes_before_it_counts_is_not_reported() -> None:
    reads = iter(range(600))

    def seldom(motion: np.ndarray) -> None:
        motion[0, 0] = 0.01 * (next(reads) // (CURRENT_READS - 1))

    assert swing(seldom, 600) == []
