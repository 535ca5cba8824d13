"""Bounds of the motion sensors: the very read at which a sensor is reported, and times between."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.chain.motion_sensors import (
    BACK_RAD,
    CURRENT_READS,
    CURRENT_TRAVEL_RAD,
    GOALS_RAD,
    LONGEST_STEP_S,
    MISMATCH_RAD,
    MISMATCH_RAD_S,
    SPEED_READS,
    STANDING_RAD,
    STANDING_S,
    SWUNG_RAD,
    WINDOW_S,
    MotionSensors,
)

ROBOT = RobotConfig(name="two", joint_axes="yy")
STEP_S = 1.0 / 64.0
"""Sums of it are exact."""
NAN = float("nan")


def reports(
    current_a: Sequence[float],
    velocity_rad_s: Sequence[float],
    position_rad: Sequence[float],
    times_s: Sequence[float] | None = None,
    goals_rad: Sequence[float] | None = None,
) -> list[tuple[int, str]]:
    """Reads at which sensors of the first joint are reported; the second joint stands."""
    sensors, found = MotionSensors(ROBOT), []
    for k, reading in enumerate(zip(current_a, velocity_rad_s, position_rad, strict=True)):
        motion = np.array([[value, 0.0] for value in reading])
        time_s = k * STEP_S if times_s is None else times_s[k]
        goal_rad = np.array([0.0 if goals_rad is None else goals_rad[k], 0.0])
        lines = sensors.update(motion, goal_rad, np.ones(2, bool), time_s)
        found += [(k, line.split(": ")[1].split()[0]) for line in lines]
    return found


def varied(count: int) -> list[float]:
    """Readings that never stay the same."""
    return [0.1 + 0.01 * (k % 2) for k in range(count)]


def ramp(speed_rad_s: float, count: int) -> list[float]:
    return [speed_rad_s * STEP_S * k for k in range(count)]


def still(count: int) -> list[float]:
    return [0.0] * count


def test_a_current_counts_from_its_25th_read() -> None:
    to_and_fro = [0.25 * (k % 2) for k in range(40)]
    assert reports(still(40), varied(40), to_and_fro) == [(CURRENT_READS, "current")]


def test_a_current_counts_from_half_a_radian_of_travel() -> None:
    steps = [0.0] + [1.0 / 64.0] * 24 + [-1.0 / 64.0] * 16
    assert CURRENT_TRAVEL_RAD == 0.5
    assert reports(still(41), varied(41), np.cumsum(steps).tolist()) == [(32, "current")]
    within = np.cumsum([0.0, *([0.0] * 30), 0.2, -0.2, *([0.0] * 9)]).tolist()
    assert reports(still(42), varied(42), within) == []


def test_a_current_counts_from_a_fifth_of_a_radian_back_and_forth() -> None:
    """0.41 rad forward and 0.1 rad back is a path that is 0.2 rad longer than its way."""
    begin, turn = -0.04, 0.37
    end = turn - 0.1
    forward, back = turn - begin, end - turn
    assert (forward - back) - abs(forward + back) == BACK_RAD
    path = [begin] * 30 + [turn] + [end] * 5
    assert reports(still(36), varied(36), path) == [(31, "current")]
    less = [begin] * 30 + [turn] + [end + 0.001] * 5
    assert reports(still(36), varied(36), less) == []


def test_the_way_of_a_constant_current_is_that_of_the_position() -> None:
    """The velocity sensor is dead, too; a joint that turns one way may need a constant current."""
    assert reports(still(60), still(60), ramp(2.0, 60)) == [(SPEED_READS, "velocity")]


def test_a_constant_current_has_no_window() -> None:
    slow = [0.3 * np.sin(0.5 * k * STEP_S) for k in range(1200)]
    ((read, sensor),) = reports(still(1200), varied(1200), slow)
    assert sensor == "current"
    assert read * STEP_S > 2.0 * WINDOW_S


def test_a_velocity_counts_from_its_25th_read() -> None:
    found = reports(varied(40), still(40), ramp(4.0, 40))
    assert found == [(SPEED_READS, "velocity")]


def test_a_difference_of_position_and_velocity_counts_from_its_limit() -> None:
    for read in (SPEED_READS, 30, 50):
        limit_rad = MISMATCH_RAD + MISMATCH_RAD_S * (read * STEP_S)
        jump = [0.0] * read + [limit_rad] * 20
        assert reports(varied(read + 20), still(read + 20), jump) == [(read, "velocity")]


def test_the_limit_of_a_difference_grows_with_time() -> None:
    """0.3 rad/s exceed 0.15 rad and 0.1 rad/s after 0.75 s."""
    assert reports(varied(80), still(80), ramp(0.3125, 80)) == [(46, "velocity")]
    assert 0.3125 * 45 * STEP_S < MISMATCH_RAD + MISMATCH_RAD_S * 45 * STEP_S
    assert 0.3125 * 46 * STEP_S >= MISMATCH_RAD + MISMATCH_RAD_S * 46 * STEP_S


def test_a_slow_drift_begins_again_after_the_window() -> None:
    """Without the window the differences would exceed their limits after 7.5 and 2.5 s."""
    count = round(10.0 / STEP_S)
    assert reports(varied(count), still(count), ramp(0.12, count)) == []
    slow_rad_s = [0.15 + 0.02 * (k % 2) for k in range(count)]
    assert reports(varied(count), slow_rad_s, [0.1] * count) == []


def test_the_window_ends_with_its_last_read() -> None:
    """A difference that exceeds the limit in the very next read begins again before."""
    step_s = 1.0 / 16.0
    each_rad = 0.0108
    last = round(WINDOW_S / step_s)
    assert last * each_rad < MISMATCH_RAD + MISMATCH_RAD_S * last * step_s
    after = last + 1
    assert after * each_rad > MISMATCH_RAD + MISMATCH_RAD_S * after * step_s
    times_s = [k * step_s for k in range(100)]
    path = [each_rad * k for k in range(100)]
    assert reports(varied(100), still(100), path, times_s) == []


def test_each_sensor_is_reported_once_though_others_follow() -> None:
    sensors, lines = MotionSensors(ROBOT), []
    for k in range(120):
        to_and_fro = 0.25 * (k % 2)
        motion = np.array(
            [
                [0.1, 0.1 if k > 40 else to_and_fro],
                [to_and_fro, to_and_fro],
                [to_and_fro, to_and_fro],
            ]
        )
        lines += sensors.update(motion, np.zeros(2), np.ones(2, bool), k * STEP_S)
    assert [line.split(": ")[0] for line in lines] == [ROBOT.joint_label(j) for j in (0, 1)]


@pytest.mark.parametrize("step_s", [0.0, -STEP_S, LONGEST_STEP_S + STEP_S])
def test_time_that_stands_runs_back_or_jumps_shows_nothing(step_s: float) -> None:
    times_s = [step_s * k for k in range(80)]
    to_and_fro = [0.25 * (k % 2) for k in range(80)]
    assert reports(still(80), varied(80), to_and_fro, times_s) == []
    assert reports(varied(80), still(80), ramp(4.0, 80), times_s) == []


@pytest.mark.parametrize(
    ("pause_s", "read"), [(LONGEST_STEP_S, CURRENT_READS), (0.11, CURRENT_READS + 10)]
)
def test_a_comparison_begins_again_after_a_longer_pause(pause_s: float, read: int) -> None:
    times_s = [(k - 9) * STEP_S for k in range(10)] + [pause_s + k * STEP_S for k in range(40)]
    to_and_fro = [0.25 * (k % 2) for k in range(50)]
    assert reports(still(50), varied(50), to_and_fro, times_s) == [(read, "current")]


def test_a_comparison_begins_again_after_a_reading_that_is_unknown() -> None:
    velocity, position = varied(60), [0.25 * (k % 2) for k in range(60)]
    velocity[10] = NAN
    ((read, sensor),) = reports(still(60), velocity, position)
    assert (read, sensor) == (11 + CURRENT_READS, "current")
    position = ramp(4.0, 60)
    position[10] = NAN
    ((read, sensor),) = reports(varied(60), still(60), position)
    assert (read, sensor) == (11 + SPEED_READS, "velocity")


def swings(forth_reads: int, back_reads: int, speed_rad_s: float = 0.25) -> list[float]:
    """Velocities of a joint that turns forth and back after a rest."""
    return [*still(30), *[speed_rad_s] * forth_reads, *[-speed_rad_s] * back_reads, *still(20)]


def test_a_constant_position_contradicts_a_velocity_that_swings() -> None:
    """A soft joint with a constant angle swung by 0.06 rad for 6 s, and nothing reported it."""
    reads = math.ceil(SWUNG_RAD / 0.25 / STEP_S)
    velocity = swings(reads + 1, reads + 1)
    ((read, sensor),) = reports(varied(len(velocity)), velocity, [0.1] * len(velocity))
    assert sensor == "position"
    assert read > 30 + reads
    for few in (swings(reads - 2, 40), swings(20, reads - 2), swings(40, 0)):
        assert reports(varied(len(few)), few, [0.1] * len(few)) == []


def test_a_swing_of_slow_velocities_is_noise() -> None:
    velocity = swings(200, 200, 0.99 * MISMATCH_RAD_S) * 3
    assert reports(varied(len(velocity)), velocity, [0.1] * len(velocity)) == []


def test_a_swing_begins_again_when_the_position_changes() -> None:
    reads = math.ceil(SWUNG_RAD / 0.25 / STEP_S)
    velocity = swings(reads + 1, reads + 1)
    position = [0.1] * (30 + reads) + [0.1015] * (len(velocity) - 30 - reads)
    assert reports(varied(len(velocity)), velocity, position) == []


def jam(
    goal_rad: float, moved_rad: float = 0.0, seconds: float = STANDING_S + 1.0
) -> list[tuple[int, str]]:
    """Reports of a joint whose goals swing once to ``goal_rad``, and that moves meanwhile."""
    count = round(seconds / STEP_S)
    goals = [goal_rad * (30 < k < 90) for k in range(count)]
    position = [moved_rad * (k % 40 < 20) for k in range(count)]
    return reports(varied(count), [0.01 * (k % 3) for k in range(count)], position, None, goals)


def test_a_joint_that_stands_while_its_goals_swing_is_reported() -> None:
    """A jammed soft joint pushed with its permitted current, and nothing reported it."""
    for goal_rad in (GOALS_RAD, -GOALS_RAD):
        for moved_rad in (0.0, STANDING_RAD):
            ((read, word),) = jam(goal_rad, moved_rad)
            assert word == "has"
            assert STANDING_S <= read * STEP_S < STANDING_S + 0.1


def test_ground_that_holds_a_joint_off_for_a_moment_is_not_reported() -> None:
    assert jam(0.99 * GOALS_RAD) == []
    assert jam(GOALS_RAD, 1.01 * STANDING_RAD) == []
    assert jam(GOALS_RAD, seconds=STANDING_S) == []


def test_a_pause_ends_a_standstill() -> None:
    count = round((STANDING_S + 1.0) / STEP_S)
    goals = [GOALS_RAD * (k < 90) for k in range(count)]
    times_s = [k * STEP_S + (0.2 if k > 100 else 0.0) for k in range(count)]
    assert reports(varied(count), varied(count), still(count), times_s, goals) == []
