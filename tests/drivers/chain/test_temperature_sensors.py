"""Temperatures that cannot be the motors' are reported, once, and no others."""

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.chain.temperature_sensors import (
    CHANGED_K,
    COOLING_S,
    EXPECTED_ALONE_K,
    EXPECTED_RISE_K,
    RISE_S_PER_K,
    TemperatureSensors,
)
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

J = 4
STALL_A = 2.0
NAMES = [f"joint yaw_{k + 1:02d} (ID {k + 1})" for k in range(J)]
STEP_S = 0.32
HALF_A = STALL_A / np.sqrt(2.0)
"""Warms by 1 K in 4 s."""


def sensors() -> TemperatureSensors:
    return TemperatureSensors(NAMES, np.full(J, STALL_A))


def warm_up(
    rise_k: list[float], seconds: float, amps: float = HALF_A, start_c: float = 25.0
) -> list[str]:
    """Lines that are reported while readings rise evenly by ``rise_k`` (J,)."""
    found, lines = sensors(), []
    for time_s in np.arange(0.0, seconds, STEP_S):
        reading = np.rint(start_c + np.array(rise_k) * time_s / seconds)
        lines += found.update(reading, np.full(J, amps), float(time_s))
    return lines


def test_a_temperature_of_zero_is_reported_at_once_and_once() -> None:
    found = sensors()
    reading = np.array([25.0, 0.0, 26.0, 25.0])
    (line,) = found.update(reading, np.zeros(J), 0.0)
    assert line.startswith("joint yaw_02 (ID 2): temperature reads 0 C")
    assert found.update(reading, np.zeros(J), STEP_S) == []


@pytest.mark.parametrize(("after_c", "is_reported"), [(33, False), (34, True), (16, True)])
def test_a_temperature_that_jumps_is_reported_once(after_c: int, *, is_reported: bool) -> None:
    """A sensor that alternated between 30 and 70 C was silent."""
    found = sensors()
    steady = np.full(J, 25.0)
    jumped = np.array([25.0, 25.0, after_c, 25.0])
    lines = [
        line
        for k in range(20)
        for line in found.update(jumped if k % 4 == 3 else steady, np.zeros(J), k * STEP_S)
    ]
    assert len(lines) == is_reported
    if is_reported:
        assert lines[0].startswith(
            f"joint yaw_03 (ID 3): temperature has changed from 25 to {after_c} C in 0.3 s"
        )


def test_a_temperature_may_change_during_a_pause() -> None:
    found = sensors()
    assert found.update(np.full(J, 25.0), np.zeros(J), 0.0) == []
    assert found.update(np.full(J, 40.0), np.zeros(J), 10.0) == []


def test_a_temperature_that_does_not_rise_with_the_others_is_reported() -> None:
    (line,) = warm_up([10.0, 10.0, 0.0, 8.0], 60.0)
    assert line.startswith("joint yaw_03 (ID 3): temperature has read 25 C since the start")


def test_where_no_temperature_changes_all_are_reported() -> None:
    assert len(warm_up([0.0] * J, 60.0)) == J


@pytest.mark.parametrize(
    ("rise_k", "seconds", "amps"),
    [
        ([10.0] * J, 60.0, HALF_A),
        ([1.0] * J, 60.0, HALF_A),  # warm at the start: near its equilibrium
        ([1.0, 1.0, 0.0, -1.0], 60.0, HALF_A),
        ([0.0] * J, 600.0, 0.05 * STALL_A),  # not enough current to warm it
        ([0.0] * J, 12.0, HALF_A),  # not long enough
    ],
)
def test_temperatures_that_may_be_true_are_not_reported(
    rise_k: list[float], seconds: float, amps: float
) -> None:
    assert warm_up(rise_k, seconds, amps) == []


def test_the_expected_rise_is_that_of_the_current_and_of_the_cooling() -> None:
    found = sensors()
    for time_s in np.arange(0.0, 3000.0, 1.0):
        found.update(np.full(J, 25.0), np.full(J, 0.1 * STALL_A), float(time_s))
    steady_k = 0.01 / RISE_S_PER_K * COOLING_S
    assert found.expected_rise_k == pytest.approx(np.full(J, steady_k), rel=1e-3)
    assert steady_k < EXPECTED_RISE_K


def test_a_temperature_that_was_not_read_and_a_current_that_was_not_are_no_evidence() -> None:
    found = sensors()
    for time_s in np.arange(0.0, 60.0, STEP_S):
        assert found.update(np.full(J, np.nan), np.full(J, HALF_A), float(time_s)) == []
    found = sensors()
    for time_s in np.arange(0.0, 60.0, STEP_S):
        assert found.update(np.full(J, 25.0), np.full(J, np.nan), float(time_s)) == []


def reported(changes_k: list[float], rise_k: float) -> list[str]:
    """Lines after readings have changed by ``changes_k`` (J,) and currents should have warmed."""
    found, first_c = sensors(), np.full(J, 30.0)
    found.update(first_c, np.zeros(J), 0.0)
    found.expected_rise_k[:] = rise_k
    return found.update(first_c + np.array(changes_k), np.zeros(J), 0.0)


@pytest.mark.parametrize(("below_k", "count"), [(0.0, 1), (1e-9, 0)])
def test_a_constant_reading_counts_from_the_expected_rise_on(below_k: float, count: int) -> None:
    others = [0.0, CHANGED_K, CHANGED_K, CHANGED_K]
    assert len(reported(others, EXPECTED_RISE_K - below_k)) == count


@pytest.mark.parametrize(("below_k", "count"), [(0.0, J), (1e-9, 0)])
def test_a_chain_that_is_constant_counts_from_a_higher_rise_on(below_k: float, count: int) -> None:
    assert len(reported([0.0] * J, EXPECTED_ALONE_K - below_k)) == count


@pytest.mark.parametrize(
    ("changes_k", "count"),
    [
        ([0.0, 0.0, 0.0, CHANGED_K], 3),  # one that changes is enough, if it warms up
        ([0.0, 0.0, 0.0, CHANGED_K - 0.01], 0),
        ([0.0, 0.0, 1.0, CHANGED_K], 2),  # half of those that change
        ([0.0, 1.0, 1.0, CHANGED_K], 0),  # a third
        ([0.0, 1.0, CHANGED_K, CHANGED_K], 1),
        ([1.0, 1.0, 1.0, CHANGED_K], 0),
    ],
)
def test_half_of_the_readings_that_change_must_show_the_heat(
    changes_k: list[float], count: int
) -> None:
    assert len(reported(changes_k, EXPECTED_RISE_K)) == count


def test_time_that_runs_backwards_cools_nothing() -> None:
    found = sensors()
    found.update(np.full(J, 25.0), np.full(J, HALF_A), 10.0)
    found.update(np.full(J, 25.0), np.full(J, HALF_A), 12.0)
    before_k = found.expected_rise_k.copy()
    found.update(np.full(J, 25.0), np.full(J, HALF_A), 11.5)
    assert (found.expected_rise_k == before_k).all()


ROBOT = RobotConfig(name="two", joint_axes="yy")


def test_a_run_reports_a_sensor_that_reads_zero() -> None:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(2))
    line.firmware.protection.temperature_c[1] = 0.0
    chain = ServoChain(DynamixelBus(line), ROBOT)
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    assert (
        len([each for each in events if "joint yaw_02 (ID 2): temperature reads 0 C" in each]) == 1
    )
    assert not any("joint 1" in each for each in events)
