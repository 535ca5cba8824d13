"""What servos see of their own motors where something holds the shaft or limits the current."""

import numpy as np
import pytest

from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import MOTORS
from tests.helpers.bus import a_line, ask, exchange, goals, read, write
from tests.sim.faults.test_faults import fault, scripted, wait

XM430 = MOTORS["XM430-W350"]


def blocked(mode: int, *writes: tuple[int, int, int]) -> SimLine:
    """One servo whose shaft does not turn, for three seconds."""
    line = SimLine(ServoBank([1]), BenchPlant(1, inertia_kg_m2=1e6))
    for address, value, size in ((11, mode, 1), *writes, (64, 1, 1)):
        assert write(line, 1, address, value, size) == 0
    write(line, 1, 116, 4000, 4)
    wait(line, 3.0)
    return line


@pytest.mark.parametrize("mode", [0, 5])
def test_a_motor_at_its_goal_current_may_push_for_ever(mode: int) -> None:
    """A gripper that holds something is no overload; its output is what the current needs."""
    line = blocked(mode, (102, 100, 2))
    assert read(line, 1, 70, 1) == 0
    assert read(line, 1, 64, 1) == 1
    assert read(line, 1, 126, 2) == 100
    fraction = 0.269 * XM430.resistance_ohm / line.firmware.drive.supply_v[0]
    assert read(line, 1, 124, 2) == pytest.approx(885 * fraction, abs=1)


def test_a_motor_that_may_push_with_nothing_is_not_overloaded() -> None:
    line = blocked(16, (100, 0, 2))
    assert (read(line, 1, 70, 1), read(line, 1, 64, 1)) == (0, 1)


def test_a_motor_that_pushes_with_all_it_has_is() -> None:
    assert read(blocked(3), 1, 70, 1) == 0x20


def test_a_stuck_servo_trips_at_the_output_that_it_may_give() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=0.5), joints=1)
    for address, value, size in ((100, 300, 2), (64, 1, 1)):
        write(line, 1, address, value, size)
    wait(line, 0.5)
    exchange(line, goals({1: 3500}))
    assert read(line, 1, 124, 2) == 300
    wait(line, 1.5)
    assert read(line, 1, 70, 1) == 0x20


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("profile", [0, 200])
def test_a_stuck_servo_is_stuck_for_group_writes_and_profiles_too(profile: int) -> None:
    line = scripted(fault("stuck", ids=[1], at_s=0.5), joints=2)
    for servo in (1, 2):
        write(line, servo, 112, profile, 4)
        write(line, servo, 64, 1, 1)
    wait(line, 0.5)
    pushed = []
    for _ in range(100):
        exchange(line, goals({1: 3500, 2: 3500}))
        pushed.append(read(line, 1, 124, 2))
        assert abs(read(line, 1, 132, 4) - 2048) < 30
    assert read(line, 2, 132, 4) > 3000
    assert max(pushed) == 885
    assert read(line, 1, 70, 1) == 0x20


def test_a_stuck_servo_draws_no_more_than_its_goal_current() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=0.5), joints=1)
    for address, value, size in ((11, 5, 1), (102, 100, 2), (64, 1, 1)):
        write(line, 1, address, value, size)
    wait(line, 0.5)
    exchange(line, goals({1: 3500}))
    wait(line, 2.0)
    assert read(line, 1, 126, 2) == 100
    assert (read(line, 1, 70, 1), read(line, 1, 64, 1)) == (0, 1)


def test_a_jam_that_ends_lets_the_servo_go_where_it_was_told() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=0.5, for_s=0.5), joints=1)
    write(line, 1, 64, 1, 1)
    wait(line, 0.5)
    exchange(line, goals({1: 2400}))
    wait(line, 0.6)
    assert ask(line, 1, 1)[0].error == 0
    wait(line, 1.0)
    assert read(line, 1, 132, 4) == pytest.approx(2400, abs=15)
    assert np.isinf(a_line(1).firmware.drive.current_limit_a).all()
