"""What registers do in time: drive, watchdog, protections, reboot; e-manual XM430-W350."""

import math

import numpy as np
import pytest

from snakewalk.drivers.protocol.packet import ALERT, Instruction, ResultError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad
from snakewalk.sim.servo.protection import SupplyAndAmbient
from tests.helpers.bus import a_line, ask, rad, read, write

XM430 = MOTORS["XM430-W350"]


def pause(line: SimLine, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


def held_line(load_n_m: float, **around: float) -> SimLine:
    """One servo, torque on, against a constant load."""
    plant = BenchPlant(1, dry_n_m=0.0, load_n_m=lambda q: np.full_like(q, load_n_m))
    line = SimLine(
        ServoBank([1]), plant, supply_and_ambient=SupplyAndAmbient(**{"supply_v": 12.0} | around)
    )
    write(line, 1, 9, 0, 1)
    write(line, 1, 64, 1, 1)
    return line


def test_motor_constants_give_back_the_specification_table() -> None:
    for motor in MOTORS.values():
        amps = motor.nominal_v / motor.resistance_ohm
        assert amps == pytest.approx(motor.stall_current_a)
        assert amps * motor.torque_constant_n_m_a == pytest.approx(motor.stall_torque_n_m)
        at_speed_v = motor.back_emf_v_s * motor.no_load_rad_s
        assert at_speed_v == pytest.approx(motor.nominal_v)


def test_p_gain_is_the_manuals_formula() -> None:
    """100 ticks of error at gain 800: 100 * 800 / 128 = 625 of 885 PWM units."""
    fraction = p_gain_per_rad(800, XM430) * 100 / XM430.positions_per_rad
    assert fraction == pytest.approx(625 / 885)


def test_stall_and_no_load_on_the_bench() -> None:
    drive = make_drive([XM430], 12.0)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = 1e6
    drive.goal_rad[:] = 1e6
    free = BenchPlant(1, dry_n_m=0.0)
    free.advance(3.0, drive)
    assert free.velocity_rad_s[0] == pytest.approx(46 * math.tau / 60, rel=1e-3)
    stuck = BenchPlant(1, inertia_kg_m2=1e6)
    stuck.advance(0.1, drive)
    assert drive.torque_n_m[0] == pytest.approx(4.1, rel=1e-3)
    assert drive.current_a[0] == pytest.approx(2.3, rel=1e-3)


def test_a_load_is_held_with_the_lag_that_the_gain_gives() -> None:
    """Torque t needs t / k_t ampere, R i volt, and so PWM over gain of lag."""
    line = held_line(-0.5, supply_ohm=0.0)
    pause(line, 1.0)
    pwm = 0.5 / XM430.torque_constant_n_m_a * XM430.resistance_ohm / 12.0
    lag_ticks = pwm * 885 * 128 / 800
    assert read(line, 1, 132, 4) == pytest.approx(2048 - lag_ticks, abs=1)
    assert read(line, 1, 126, 2) == pytest.approx(
        0.5 / XM430.torque_constant_n_m_a / 2.69e-3, abs=1
    )
    assert read(line, 1, 124, 2) == pytest.approx(pwm * 885, abs=1)
    assert read(line, 1, 128, 4) == 0


def test_torque_off_lets_go_and_draws_nothing() -> None:
    line = held_line(-0.5)
    pause(line, 0.5)
    write(line, 1, 64, 0, 1)
    pause(line, 0.2)
    assert read(line, 1, 132, 4) < 2000
    assert read(line, 1, 126, 2) == 0


def test_current_based_mode_gives_way_at_its_goal_current() -> None:
    plant = BenchPlant(1, dry_n_m=0.0, load_n_m=lambda q: np.full_like(q, -1.5))
    line = SimLine(ServoBank([1]), plant)
    write(line, 1, 11, 5, 1)
    write(line, 1, 102, 223, 2)  # 0.6 A, so 1.07 N m
    write(line, 1, 64, 1, 1)
    pause(line, 0.3)
    assert line.firmware.drive.current_a[0] == pytest.approx(223 * 2.69e-3)
    assert read(line, 1, 132, 4) < 1900
    assert held_line(-1.5).firmware.drive.current_limit_a[0] == np.inf


def test_pwm_and_current_modes_push_as_told() -> None:
    stuck = BenchPlant(2, inertia_kg_m2=1e6)
    line = SimLine(ServoBank([1, 2]), stuck)
    write(line, 1, 11, 16, 1)
    write(line, 1, 100, -177, 2)
    write(line, 2, 11, 0, 1)
    write(line, 2, 102, 100, 2)
    for servo in (1, 2):
        write(line, servo, 64, 1, 1)
    pause(line, 0.1)
    amps = line.firmware.drive.current_a
    supply_v = line.firmware.drive.supply_v[0]
    assert amps[0] == pytest.approx(-0.2 * supply_v / XM430.resistance_ohm, rel=0.01)
    assert amps[1] == pytest.approx(0.269)
    write(line, 2, 102, 0, 2)
    pause(line, 0.01)
    assert amps[1] == 0.0


def test_goal_pwm_limits_the_output() -> None:
    line = held_line(0.0)
    write(line, 1, 100, 177, 2)
    write(line, 1, 116, 4000, 4)
    pause(line, 0.2)
    assert line.firmware.drive.pwm[0] == pytest.approx(0.2)


def test_reverse_mode_and_homing_offset() -> None:
    plant = BenchPlant(1, start_rad=rad(2148))
    line = SimLine(ServoBank([1]), plant)
    assert read(line, 1, 132, 4) == 2148
    write(line, 1, 20, 50, 4)
    assert read(line, 1, 132, 4) == 2198
    write(line, 1, 10, 1, 1)
    assert read(line, 1, 132, 4) == 1998
    write(line, 1, 116, 1998, 4)
    assert line.firmware.drive.goal_rad[0] == pytest.approx(rad(2148))


def test_a_new_mode_sets_gains_and_profile_back() -> None:
    """E-manual, Operating Mode(11), note."""
    line = a_line(1)
    for address, value, size in ((84, 300, 2), (112, 40, 4), (100, 200, 2), (102, 100, 2)):
        write(line, 1, address, value, size)
    write(line, 1, 11, 5, 1)
    seen = [
        read(line, 1, address, size) for address, size in ((84, 2), (112, 4), (100, 2), (102, 2))
    ]
    assert seen == [800, 0, 885, 1193]


def test_turns_count_in_extended_mode_until_reboot() -> None:
    plant = BenchPlant(1, start_rad=0.0)
    line = SimLine(ServoBank([1]), plant)
    write(line, 1, 11, 4, 1)
    plant.position_rad[:] = 2.25 * math.tau
    turned = 2048 + round(2.25 * 4096)
    assert read(line, 1, 132, 4) == turned
    ask(line, 1, Instruction.REBOOT)
    assert read(line, 1, 132, 4) == turned % 4096
    assert read(line, 1, 116, 4) == turned % 4096  # goal = present
    plant.position_rad[:] = -0.75 * math.tau
    assert ask(line, 1, Instruction.CLEAR, b"\x01DXL\x22")[0].error == 0
    assert 0 <= read(line, 1, 132, 4) < 4096


# bus watchdog: e-manual, Bus Watchdog(98)


def test_watchdog_stops_the_servo_and_locks_its_goals() -> None:
    line = held_line(0.0)
    write(line, 1, 98, 5, 1)  # 100 ms
    write(line, 1, 116, 4000, 4)
    last_s = line.clock.now_s() - 0.02  # the helper listens for 20 ms
    line.clock.sleep_until_s(last_s + 0.099)
    line.settle()
    assert line.bank["Bus Watchdog"][0] == 5
    line.clock.sleep_until_s(last_s + 0.102)
    line.settle()
    assert read(line, 1, 98, 1) == -1
    pause(line, 0.5)
    stopped = read(line, 1, 132, 4)
    pause(line, 0.5)
    assert abs(read(line, 1, 132, 4) - stopped) <= 1
    assert stopped < 3000
    assert line.bank["Torque Enable"][0] == 1
    assert write(line, 1, 116, 2100, 4) == ResultError.DATA_RANGE
    assert write(line, 1, 98, 0, 1) == 0
    assert write(line, 1, 116, 2100, 4) == 0
    pause(line, 1.0)
    assert read(line, 1, 132, 4) == pytest.approx(2100, abs=1)


def test_watchdog_stops_a_pushing_motor_too() -> None:
    line = SimLine(ServoBank([1]), BenchPlant(1))
    for address, value, size in ((11, 16, 1), (100, 300, 2), (98, 5, 1), (64, 1, 1)):
        write(line, 1, address, value, size)
    line.settle()
    assert line.firmware.plant.velocity_rad_s[0] > 0.5
    pause(line, 2.0)
    assert line.firmware.plant.velocity_rad_s[0] == pytest.approx(0.0, abs=1e-3)


def test_any_instruction_feeds_the_watchdog_of_all() -> None:
    line = a_line(2)
    for servo in (1, 2):
        write(line, servo, 64, 1, 1)
        write(line, servo, 98, 5, 1)
    for _ in range(10):
        ask(line, 1, Instruction.PING)  # 20 ms each
        pause(line, 0.06)
    assert line.bank["Bus Watchdog"].tolist() == [5, 5]


def test_watchdog_sleeps_while_torque_is_off() -> None:
    line = a_line(1)
    write(line, 1, 98, 1, 1)
    pause(line, 1.0)
    assert line.bank["Bus Watchdog"][0] == 1


# protections: Shutdown(63), Hardware Error Status(70)


def test_overload_shuts_down_until_reboot_and_still_answers() -> None:
    line = held_line(-6.0)  # more than the stall torque
    pause(line, 3.0)
    assert read(line, 1, 70, 1) == 0x20
    assert read(line, 1, 64, 1) == 0
    assert write(line, 1, 64, 1, 1) == ALERT | ResultError.RESULT_FAIL
    assert ask(line, 1, Instruction.PING)[0].error == ALERT
    assert ask(line, 1, Instruction.REBOOT)[0].error == 0
    assert write(line, 1, 64, 1, 1) == 0


def test_masked_out_errors_are_shown_but_keep_the_torque() -> None:
    line = held_line(-6.0)
    write(line, 1, 64, 0, 1)
    write(line, 1, 63, 0, 1)
    write(line, 1, 64, 1, 1)
    pause(line, 3.0)
    assert read(line, 1, 70, 1) == 0x20
    assert read(line, 1, 64, 1) == 1


def test_heat_is_that_of_the_whole_time_however_often_somebody_looks() -> None:
    """A goal that jumps back and forth: most of the heat is in the first milliseconds after it."""
    heats_j = []
    for looks in (1, 20):
        plant = BenchPlant(1, step_s=1e-3)
        line = SimLine(ServoBank([1]), plant, supply_and_ambient=SupplyAndAmbient(supply_v=12.0))
        write(line, 1, 64, 1, 1)
        for k in range(50):
            write(line, 1, 116, 2048 + 200 * (k % 2), 4)
            for _ in range(looks):
                pause(line, 0.1 / looks)
        heats_j.append(line.firmware.protection.temperature_c[0] - 25.0)
        expected = XM430.winding_k_per_w * line.firmware.drive.heat_j[0] / XM430.thermal_time_s
    assert heats_j[0] == pytest.approx(heats_j[1], rel=0.01)
    assert heats_j[0] == pytest.approx(expected, rel=0.05)


def test_heat_follows_i_squared_r_and_shuts_down_over_the_limit() -> None:
    line = held_line(-2.0, supply_ohm=0.0)
    amps = 2.0 / XM430.torque_constant_n_m_a
    rise = XM430.winding_k_per_w * amps**2 * XM430.resistance_ohm
    pause(line, 20.0)
    expected = 25.0 + rise * (1.0 - math.exp(-20.0 / XM430.thermal_time_s))
    assert line.firmware.protection.temperature_c[0] == pytest.approx(expected, abs=0.3)
    write(line, 1, 64, 0, 1)
    write(line, 1, 31, 26, 1)
    write(line, 1, 64, 1, 1)
    pause(line, 0.1)
    assert read(line, 1, 70, 1) & 0x04
    assert read(line, 1, 64, 1) == 0


def test_supply_sags_under_load() -> None:
    line = held_line(-2.0, supply_ohm=0.5)
    pause(line, 1.0)
    drive = line.firmware.drive
    drawn_a = drive.pwm[0] * drive.current_a[0] + XM430.standby_a
    assert read(line, 1, 144, 2) == round(10 * (12.0 - 0.5 * drawn_a))
    assert read(line, 1, 144, 2) < 120


def test_a_small_servo_has_its_own_nominal_supply() -> None:
    line = a_line(1, model="XL330-M288")
    write(line, 1, 64, 1, 1)
    pause(line, 0.2)
    assert read(line, 1, 144, 2) == 50
    assert (read(line, 1, 0, 2), read(line, 1, 70, 1), read(line, 1, 64, 1)) == (1200, 0, 1)


def test_low_supply_is_an_input_voltage_error_that_keeps_the_torque() -> None:
    """Bit 0 is not in the initial Shutdown value, 52."""
    line = held_line(0.0, supply_v=9.0)
    pause(line, 0.1)
    assert read(line, 1, 70, 1) == 0x01
    assert read(line, 1, 64, 1) == 1
