"""What registers make a shaft do, and what a moving shaft shows in them; e-manual, X series."""

import math

import numpy as np
import pytest

from snakewalk.drivers.protocol.packet import Instruction, ResultError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.bus import ALL, a_line, ask, exchange, goals, group_params, read, write
from tests.sim.faults.test_faults import fault, scripted, wait

RUN = ((64, 1, 1),)
MOVING, STATUS, POSITION, VELOCITY = 122, 123, 132, 128
IN_POSITION, ONGOING, FOLLOWING_ERROR = 0x01, 0x02, 0x08


def running(*writes: tuple[int, int, int], **bench: object) -> SimLine:
    """One servo after these writes."""
    line = a_line(1, **bench)
    for each in writes:
        assert write(line, 1, *each) == 0, each
    return line


# modes


def test_torque_on_in_velocity_mode_turns_nothing_until_there_is_a_goal() -> None:
    """E-manual, Bus Watchdog(98), example: mode, torque on, then a goal, and it rotates."""
    line = running((11, 1, 1), *RUN)
    wait(line, 1.0)
    assert (read(line, 1, VELOCITY, 4), read(line, 1, 104, 4)) == (0, 0)
    write(line, 1, 104, 50, 4)
    wait(line, 1.0)
    assert read(line, 1, VELOCITY, 4) == pytest.approx(50, abs=2)
    ask(line, 1, Instruction.REBOOT)
    write(line, 1, 64, 1, 1)
    wait(line, 1.0)
    assert read(line, 1, VELOCITY, 4) == 0


@pytest.mark.parametrize("mode", [4, 5])
def test_multi_turn_modes_run_over_several_turns_and_back(mode: int) -> None:
    line = running((11, mode, 1), *RUN, (116, 2_048 + 3 * 4_096, 4))
    wait(line, 6.0)
    assert read(line, 1, POSITION, 4) == pytest.approx(2_048 + 3 * 4_096, abs=15)
    assert line.firmware.plant.position_rad[0] == pytest.approx(3 * math.tau, abs=0.03)
    write(line, 1, 116, -2_048, 4)
    wait(line, 8.0)
    assert read(line, 1, POSITION, 4) == pytest.approx(-2_048, abs=15)


def test_current_based_position_reaches_its_goal_where_the_current_is_enough() -> None:
    def lift(goal_current: int) -> int:
        plant = BenchPlant(1, dry_n_m=0.0, load_n_m=lambda q: np.full_like(q, -0.5))
        line = SimLine(ServoBank([1]), plant)
        for each in ((11, 5, 1), (102, goal_current, 2), *RUN, (116, 2_500, 4)):
            assert write(line, 1, *each) == 0
        wait(line, 2.0)
        return read(line, 1, POSITION, 4)

    assert lift(300) == pytest.approx(2_500, abs=40)  # 0.81 A, 1.4 N m
    assert lift(60) < 2_000  # 0.16 A, 0.29 N m: the load wins


def test_pwm_mode_turns_at_its_share_of_the_no_load_speed() -> None:
    line = running((11, 16, 1), (100, 442, 2), *RUN, dry_n_m=0.0)
    wait(line, 2.0)
    rpm = line.firmware.plant.velocity_rad_s[0] * 60 / math.tau
    volts = line.firmware.drive.supply_v[0]
    assert rpm == pytest.approx(46 * 442 / 885 * volts / 12, rel=0.02)
    assert read(line, 1, 124, 2) == 442


def test_current_mode_pushes_with_its_current_whatever_the_speed() -> None:
    line = running((11, 0, 1), (102, -100, 2), *RUN, dry_n_m=0.0, inertia_kg_m2=0.5)
    for _ in range(3):
        wait(line, 0.2)
        assert read(line, 1, 126, 2) == -100
    assert line.firmware.plant.velocity_rad_s[0] < -0.3


# profiles


@pytest.mark.parametrize("way", [512, -1_024])
def test_a_time_based_profile_takes_its_time_whatever_the_way(way: int) -> None:
    """Drive Mode(10) bit 2: Profile Velocity(112) in ms, Profile Acceleration(108) too."""
    line = running((10, 4, 1), (112, 1_000, 4), (108, 300, 4), *RUN)
    write(line, 1, 116, 2_048 + way, 4)
    last = line.clock.now_s() - 0.02
    line.clock.sleep_until_s(last + 0.5)
    assert read(line, 1, 140, 4) == pytest.approx(2_048 + way / 2, abs=abs(way) * 0.06)
    line.clock.sleep_until_s(last + 0.96)
    assert read(line, 1, STATUS, 1) & ONGOING
    line.clock.sleep_until_s(last + 1.05)
    assert not read(line, 1, STATUS, 1) & ONGOING
    assert read(line, 1, 140, 4) == 2_048 + way


def test_a_profile_of_velocity_0_is_a_step_and_only_positions_have_profiles() -> None:
    line = running((108, 50, 4), *RUN, (116, 3_000, 4))
    assert read(line, 1, 140, 4) == 3_000
    assert read(line, 1, STATUS, 1) & 0x32 == 0
    line = running((11, 1, 1), (108, 10, 4), *RUN, (104, 100, 4))
    wait(line, 0.2)
    assert read(line, 1, STATUS, 1) == 0


def test_reverse_mode_turns_a_profile_around() -> None:
    line = running((10, 1, 1), (112, 100, 4), *RUN, (116, 2_500, 4))
    wait(line, 3.0)
    assert read(line, 1, POSITION, 4) == pytest.approx(2_500, abs=15)
    assert line.firmware.plant.position_rad[0] == pytest.approx(-452 * math.tau / 4_096, abs=0.03)


# Moving(122), Moving Status(123)


def test_moving_follows_its_threshold_or_a_profile() -> None:
    line = running((24, 100, 4), (11, 1, 1), *RUN, (104, 80, 4))
    wait(line, 1.0)
    assert (read(line, 1, VELOCITY, 4) > 70, read(line, 1, MOVING, 1)) == (True, 0)
    write(line, 1, 104, 150, 4)
    wait(line, 1.0)
    assert read(line, 1, MOVING, 1) == 1
    slow = running((24, 100, 4), (112, 20, 4), *RUN, (116, 3_000, 4))
    wait(slow, 0.5)
    assert read(slow, 1, MOVING, 1) == 1  # a profile is ongoing, however slow


def test_in_position_goes_with_the_goal_and_following_error_with_the_trajectory() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=1.0), joints=1)
    for each in (*RUN, (112, 40, 4)):
        write(line, 1, *each)
    wait(line, 0.1)
    assert read(line, 1, STATUS, 1) & (IN_POSITION | FOLLOWING_ERROR) == IN_POSITION
    write(line, 1, 116, 2_200, 4)
    wait(line, 0.1)
    assert read(line, 1, STATUS, 1) & (IN_POSITION | ONGOING) == ONGOING
    wait(line, 0.8)
    write(line, 1, 116, 3_000, 4)
    wait(line, 0.8)
    assert read(line, 1, STATUS, 1) & FOLLOWING_ERROR


# Bus Watchdog(98)


@pytest.mark.parametrize("code", [Instruction.SYNC_READ, Instruction.FAST_SYNC_READ])
def test_reads_alone_feed_the_watchdog_and_silence_trips_it(code: int) -> None:
    line = a_line(3)
    for servo in (1, 2, 3):
        write(line, servo, 64, 1, 1)
        write(line, servo, 98, 3, 1)
    for _ in range(20):
        assert ask(line, ALL, code, group_params(132, 4, (1, 2, 3)))
        wait(line, 0.03)
    assert line.bank["Bus Watchdog"].tolist() == [3, 3, 3]
    wait(line, 0.04)
    assert line.bank["Bus Watchdog"].tolist() == [255] * 3
    for servo in (1, 2, 3):
        assert read(line, servo, 98, 1) == -1


def test_a_packet_that_is_no_instruction_feeds_no_watchdog() -> None:
    line = running(*RUN, (98, 3, 1))
    for _ in range(5):
        exchange(line, b"\xff\xff\xfd\x00\x01\x03\x00\x01\x00\x00")  # a ping with a wrong CRC
    assert line.bank["Bus Watchdog"][0] == 255


@pytest.mark.parametrize("ramp", [0, 1])
def test_the_manuals_example_of_the_watchdog(ramp: int) -> None:
    """Steps 1 to 8; the stop has no profile (step 4)."""
    line = running((11, 1, 1), *RUN, (104, 50, 4), (98, 100, 1), (108, ramp, 4))
    wait(line, 1.9)
    assert line.firmware.plant.velocity_rad_s[0] > 1.0
    wait(line, 0.8)
    assert line.firmware.plant.velocity_rad_s[0] == pytest.approx(0.0, abs=0.02)
    assert read(line, 1, 98, 1) == -1
    assert write(line, 1, 104, 150, 4) == ResultError.DATA_RANGE
    exchange(line, goals({1: 3_000}))
    assert read(line, 1, 116, 4) == 2_048
    assert write(line, 1, 98, 0, 1) == 0
    assert write(line, 1, 108, 0, 4) == 0
    assert write(line, 1, 104, 150, 4) == 0
    wait(line, 1.0)
    assert read(line, 1, VELOCITY, 4) == pytest.approx(150, abs=3)


@pytest.mark.parametrize("mode", [1, 3])
def test_a_watchdogs_stop_leaves_no_profile(mode: int) -> None:
    """E-manual, Bus Watchdog(98), example, step 4: both registers are 0 then."""
    line = running((11, mode, 1), *RUN, (108, 5, 4), (112, 40, 4), (98, 3, 1))
    other = (read(line, 1, 108, 4), read(line, 1, 112, 4))
    assert other == (5, 40)
    wait(line, 0.1)
    assert read(line, 1, 98, 1) == -1
    assert (read(line, 1, 108, 4), read(line, 1, 112, 4)) == (0, 0)


# Startup Configuration(60)


@pytest.mark.parametrize("configuration", [0, 1, 2, 3])
def test_startup_configuration_says_how_it_wakes_up(configuration: int) -> None:
    line = running((60, configuration, 1), (84, 321, 2), (112, 30, 4), (98, 9, 1))
    assert ask(line, 1, Instruction.CONTROL_TABLE_BACKUP, b"\x01CTRL")[0].error == 0
    line.firmware.cut_power(np.array([0]))
    wait(line, 0.1)
    line.firmware.restore_power(np.array([0]))
    restored = bool(configuration & 2)
    assert (read(line, 1, 84, 2), read(line, 1, 112, 4)) == ((321, 30) if restored else (800, 0))
    assert read(line, 1, 64, 1) == configuration & 1
    assert read(line, 1, 98, 1) == 0  # not among what is saved
    before = read(line, 1, POSITION, 4)
    wait(line, 0.5)
    assert read(line, 1, POSITION, 4) == before


def test_a_servo_that_rotates_ramps_up_beside_one_that_follows_a_profile() -> None:
    """The step of the second's trajectory put the first's ramp back to 0 in every period."""
    line = a_line(2)
    for each in ((11, 1, 1), *RUN, (108, 5, 4), (104, 50, 4)):
        assert write(line, 1, *each) == 0, each
    for each in ((112, 20, 4), (108, 5, 4), *RUN, (116, 3_000, 4)):
        assert write(line, 2, *each) == 0, each
    wait(line, 2.0)
    assert read(line, 1, VELOCITY, 4) == pytest.approx(50, abs=2)
    assert read(line, 2, VELOCITY, 4) == pytest.approx(20, abs=2)
