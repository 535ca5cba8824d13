"""Modes, profiles, gains, indirect addresses, secondary IDs, backup: e-manual, X series."""

import math

import numpy as np
import pytest

from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.protocol.control_table import load_control_table
from snakewalk.drivers.protocol.packet import Instruction, ResultError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.profile import Trajectory
from snakewalk.sim.servo.register_rules import simulated_models
from tests.helpers.bus import a_line, ask, group_params, read, write

RUN = ((64, 1, 1),)

XM430 = servo_model("XM430-W350")
RAD_S, RAD_S2 = XM430.rad_s_per_velocity, XM430.rad_s2_per_acceleration


def setup(line: SimLine, *writes: tuple[int, int, int], servo: int = 1) -> None:
    for address, value, size in writes:
        assert write(line, servo, address, value, size) == 0, address


def wait(line: SimLine, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


@pytest.mark.fast_cases(17)
@pytest.mark.parametrize(
    "model", [name for name in simulated_models() if servo_model(name).ram_from == 64]
)
def test_every_model_of_the_x_series_moves_where_it_is_told(model: str) -> None:
    line = SimLine(ServoBank([1], model), BenchPlant(1, inertia_kg_m2=5e-4, dry_n_m=0.0))
    assert read(line, 1, 0, 2) == load_control_table(line.bank.models[0]).model_number
    setup(line, *RUN, (116, 2500, 4))
    wait(line, 2.0)
    assert read(line, 1, 132, 4) == pytest.approx(2500, abs=15)
    measures = servo_model(model).measures_current
    assert (write(line, 1, 102, 10, 2) == 0) == measures
    write(line, 1, 64, 0, 1)
    assert (write(line, 1, 11, 5, 1) == 0) == measures


@pytest.mark.parametrize("model", ["XM430-W350", "XL330-M288", "XL430-W250"])
@pytest.mark.parametrize("goal", [100, -60])
def test_velocity_mode_turns_at_its_goal_whatever_the_load(model: str, goal: int) -> None:
    line = SimLine(ServoBank([1], model), BenchPlant(1, dry_n_m=0.05))
    setup(line, (11, 1, 1), *RUN, (104, goal, 4))
    wait(line, 1.5)
    assert read(line, 1, 128, 4) == pytest.approx(goal, abs=2)
    setup(line, (104, 0, 4))
    wait(line, 1.0)
    assert abs(read(line, 1, 128, 4)) <= 2


def test_velocity_mode_ramps_by_its_profile_acceleration() -> None:
    line = SimLine(ServoBank([1]), BenchPlant(1))
    setup(line, (11, 1, 1), (108, 10, 4), *RUN, (104, 100, 4))
    ramp_s = 100 * RAD_S / (10 * RAD_S2)
    wait(line, 0.5 * ramp_s - 0.02)
    assert read(line, 1, 136, 4) == pytest.approx(50, abs=3)
    wait(line, ramp_s)
    assert read(line, 1, 136, 4) == 100


@pytest.mark.parametrize(
    ("velocity", "acceleration", "kind"),
    [(100, 0, 0x10), (100, 50, 0x30), (100, 4, 0x20)],
)
def test_a_profile_takes_the_time_of_its_shape(velocity: int, acceleration: int, kind: int) -> None:
    path, goal = Trajectory(1, RAD_S, RAD_S2), np.array([1.0])
    speed, slope = velocity * RAD_S, acceleration * RAD_S2
    path.set_goals(
        goal, np.array([float(velocity)]), np.array([float(acceleration)]), np.array([False])
    )
    assert path.kind[0] == kind
    steps, fastest = 0, 0.0
    while path.ongoing[0]:
        path.advance(1e-3, np.ones(len(path.goal), bool))
        fastest = max(fastest, path.velocity[0])
        steps += 1
    if kind == 0x10:
        wanted_s = 1.0 / speed
    elif kind == 0x30:
        wanted_s = 1.0 / speed + speed / slope
    else:
        wanted_s = 2.0 * math.sqrt(1.0 / slope)
    assert steps * 1e-3 == pytest.approx(wanted_s, rel=0.01, abs=0.003)
    assert fastest <= speed * 1.0001
    assert path.position[0] == 1.0


def test_a_time_based_profile_arrives_on_time() -> None:
    path = Trajectory(2, RAD_S, RAD_S2)
    path.set_goals(np.array([1.0, -0.3]), np.full(2, 800.0), np.full(2, 200.0), np.full(2, True))
    for _ in range(790):
        path.advance(1e-3, np.ones(len(path.goal), bool))
    assert path.ongoing.all()
    for _ in range(20):
        path.advance(1e-3, np.ones(len(path.goal), bool))
    assert not path.ongoing.any()


def test_a_profile_shows_in_the_registers_until_it_is_done() -> None:
    line = SimLine(ServoBank([1]), BenchPlant(1))
    setup(line, (112, 50, 4), (108, 20, 4), *RUN, (116, 3072, 4))
    wait(line, 0.3)
    assert 2048 < read(line, 1, 140, 4) < 3072
    assert read(line, 1, 122, 1) == 1
    assert read(line, 1, 123, 1) == 0x32
    wait(line, 4.0)
    assert read(line, 1, 140, 4) == 3072
    assert read(line, 1, 123, 1) == 0x31
    assert read(line, 1, 122, 1) == 0


def test_integral_gain_removes_the_lag_of_a_load_and_feed_forward_that_of_motion() -> None:
    lags = []
    for gain in (0, 400):
        plant = BenchPlant(1, dry_n_m=0.0, load_n_m=lambda q: np.full_like(q, -0.5))
        line = SimLine(ServoBank([1]), plant)
        setup(line, (82, gain, 2), *RUN)
        wait(line, 3.0)
        lags.append(2048 - read(line, 1, 132, 4))
    assert lags[0] >= 10
    assert abs(lags[1]) <= 1
    lags = []
    for gain in (0, 900):
        line = SimLine(ServoBank([1]), BenchPlant(1, dry_n_m=0.0))
        setup(line, (90, gain, 2), (112, 100, 4), *RUN, (116, 4000, 4))
        wait(line, 0.8)
        lags.append(read(line, 1, 140, 4) - read(line, 1, 132, 4))
    assert abs(lags[1]) < 0.5 * abs(lags[0])


def test_derivative_gain_damps() -> None:
    peaks = []
    for gain in (0, 2_000):
        line = SimLine(ServoBank([1]), BenchPlant(1, inertia_kg_m2=0.1, dry_n_m=0.0))
        setup(line, (80, gain, 2), *RUN, (116, 2600, 4))
        peak = 0
        for _ in range(100):
            wait(line, 0.005)
            peak = max(peak, read(line, 1, 132, 4))
        peaks.append(peak - 2600)
    assert peaks[1] < 0.75 * peaks[0]


def test_a_homing_offset_out_of_range_is_ignored_in_position_mode() -> None:
    line = a_line(1)
    setup(line, (20, 1_025, 4))
    assert read(line, 1, 132, 4) == 2048
    setup(line, (11, 4, 1))
    assert read(line, 1, 132, 4) == 2048 + 1_025


# indirect addresses


@pytest.mark.parametrize(("address", "data"), [(168, 224), (578, 634)])
def test_indirect_data_is_what_its_address_points_at(address: int, data: int) -> None:
    """E-manual, examples 1 and 2, on both blocks."""
    line = a_line(2)
    setup(line, (address, 65, 2), (data, 1, 1))
    assert line.bank["LED"].tolist() == [1, 0]
    setup(line, *((address + 2 * k, 115 + k, 2) for k in range(1, 5)), (data + 1, 1024, 4))
    assert line.bank["Goal Position"][0] == 1024
    assert read(line, 1, data, 1) == 1
    assert read(line, 1, data + 1, 4) == 1024
    assert write(line, 1, data + 1, 9999, 4) == ResultError.DATA_LIMIT
    setup(line, (address + 10, 132, 2))
    assert write(line, 1, data + 5, 0, 1) in (ResultError.ACCESS, ResultError.DATA_LENGTH)
    assert read(line, 1, data + 5, 1) == read(line, 1, 132, 1)
    assert write(line, 1, address, 63, 2) == ResultError.DATA_RANGE


@pytest.mark.parametrize(("model", "last"), [("XM430-W350", 661), ("XL330-M288", 251)])
def test_an_indirect_address_points_into_the_models_own_ram(model: str, last: int) -> None:
    """No further than its last register, which on the 330 models is Indirect Data 28."""
    line = a_line(1, model=model)
    assert write(line, 1, 168, last, 2) == 0
    assert write(line, 1, 168, last + 1, 2) == ResultError.DATA_RANGE


def test_a_group_read_of_indirect_data_is_fresh() -> None:
    plant = BenchPlant(3, start_rad=[0.1, 0.2, 0.3])
    line = SimLine(ServoBank([1, 2, 3]), plant)
    for servo in (1, 2, 3):
        setup(line, (9, 0, 1), *((168 + 2 * k, 132 + k, 2) for k in range(4)), servo=servo)
    for code in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ):
        plant.position_rad[:] += 0.1
        answers = ask(line, 0xFE, code, group_params(224, 4, [1, 2, 3]))
        shown = b"".join(answer.params for answer in answers)
        for joint in range(3):
            ticks = round(2048 + plant.position_rad[joint] * 4096 / math.tau)
            assert ticks.to_bytes(4, "little") in shown


# secondary ID


def test_secondary_id_as_in_the_manuals_example() -> None:
    line = a_line(5)
    for servo in range(1, 6):
        setup(line, (12, 5, 1), servo=servo)
    led = bytes((65, 0, 1))
    assert [s.servo_id for s in ask(line, 1, Instruction.WRITE, led)] == [1]
    assert line.bank["LED"].tolist() == [1, 0, 0, 0, 0]
    assert [s.servo_id for s in ask(line, 5, Instruction.WRITE, led)] == [5]
    assert line.bank["LED"].tolist() == [1] * 5
    for servo in range(1, 6):
        setup(line, (12, 100, 1), servo=servo)
    assert ask(line, 100, Instruction.WRITE, bytes((65, 0, 0))) == []
    assert line.bank["LED"].tolist() == [0] * 5
    ask(line, 100, Instruction.WRITE, bytes((31, 0, 50)))
    assert (line.bank["Temperature Limit"] == 80).all()
    goals = group_params(116, 4, [100]) + (2200).to_bytes(4, "little")
    ask(line, 0xFE, Instruction.SYNC_WRITE, goals)
    assert (line.bank["Goal Position"] == 2200).all()


# backup and restore, startup configuration, torque on by goal


def test_backup_keeps_eeprom_and_the_saved_ram_through_a_factory_reset() -> None:
    line = a_line(1)
    assert ask(line, 1, 0x20, b"\x02CTRL")[0].error == ResultError.RESULT_FAIL
    setup(line, (31, 60, 1), (84, 321, 2), (112, 30, 4), (60, 2, 1), (168, 65, 2))
    assert read(line, 1, 147, 1) == 0
    assert ask(line, 1, 0x20, b"\x01CTRL")[0].error == 0
    assert read(line, 1, 147, 1) == 1
    ask(line, 1, Instruction.FACTORY_RESET, b"\x02")
    assert (read(line, 1, 31, 1), read(line, 1, 84, 2)) == (80, 800)
    assert ask(line, 1, 0x20, b"\x02CTRL")[0].error == 0
    shown = [read(line, 1, a, n) for a, n in ((31, 1), (84, 2), (112, 4), (168, 2), (147, 1))]
    assert shown == [60, 321, 30, 65, 1]
    setup(line, *RUN)
    assert ask(line, 1, 0x20, b"\x01CTRL")[0].error == ResultError.RESULT_FAIL


def test_startup_torque_on_holds_where_it_is() -> None:
    line = a_line(1)
    setup(line, (60, 1, 1))
    ask(line, 1, Instruction.REBOOT)
    assert read(line, 1, 64, 1) == 1
    assert read(line, 1, 132, 4) == read(line, 1, 116, 4)


def test_torque_comes_on_with_a_goal_where_drive_mode_says_so() -> None:
    line = a_line(2)
    setup(line, (10, 8, 1))
    goals = bytes((116, 0, 4, 0))
    for servo in (1, 2):
        goals += bytes((servo,)) + (2100).to_bytes(4, "little")
    ask(line, 0xFE, Instruction.SYNC_WRITE, goals)
    assert line.bank["Torque Enable"].tolist() == [1, 0]
    setup(line, (64, 0, 1))
    setup(line, (116, 2000, 4))
    assert line.bank["Torque Enable"][0] == 1


def test_clearing_an_error_needs_its_cause_gone() -> None:
    line = a_line(1)
    line.firmware.protection.detect(np.array([0]), 0x20)
    assert read(line, 1, 70, 1) == 0x20
    assert ask(line, 1, Instruction.CLEAR, b"\x02ERCL")[0].error == 0
    assert read(line, 1, 70, 1) == 0
    line.firmware.protection.heat(np.array([0]), 95.0)
    assert ask(line, 1, Instruction.CLEAR, b"\x02ERCL")[0].result == ResultError.RESULT_FAIL


def test_a_factory_reset_of_everything_by_broadcast_is_refused() -> None:
    line = a_line(2)
    ask(line, 0xFE, Instruction.FACTORY_RESET, b"\xff")
    assert line.bank["ID"].tolist() == [1, 2]


def test_usb_latency_delays_what_the_host_sees_and_not_the_wire() -> None:
    times_s = []
    for latency_s in (0.0, 0.016):
        line = SimLine(ServoBank([1]), BenchPlant(1), usb_latency_s=latency_s)
        start_s, busy_s = line.clock.now_s(), line.busy_s
        line.write(bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E"))
        assert len(line.read_until(14, 1.0)) == 14
        times_s.append((line.clock.now_s() - start_s, line.busy_s - busy_s))
    assert times_s[1][0] - times_s[0][0] == pytest.approx(0.016)
    assert times_s[1][1] == times_s[0][1]


def test_a_trajectory_of_a_turned_servo_is_shown_in_its_own_direction() -> None:
    """Positions fall where those of the shaft rise, and a servo without a profile shows none."""
    line = SimLine(ServoBank([1]), BenchPlant(1))
    setup(line, (10, 1, 1), (112, 50, 4), (108, 20, 4), *RUN, (116, 3072, 4))
    wait(line, 0.5)
    assert 2048 < read(line, 1, 140, 4) < 3072
    assert read(line, 1, 140, 4) == pytest.approx(read(line, 1, 132, 4), abs=60)
    assert 0 < read(line, 1, 136, 4) <= 50
    still = SimLine(ServoBank([1]), BenchPlant(1))
    setup(still, (11, 16, 1), *RUN, (100, 100, 2))  # PWM mode
    wait(still, 0.3)
    assert read(still, 1, 136, 4) == 0


@pytest.mark.parametrize("pwm", [300, -300])
def test_a_servo_without_a_current_sensor_shows_the_load_of_its_output(pwm: int) -> None:
    line = SimLine(ServoBank([1], "XL430-W250"), BenchPlant(1, dry_n_m=50.0))
    setup(line, (11, 16, 1), *RUN, (100, pwm, 2))
    wait(line, 0.2)
    assert read(line, 1, 126, 2) == pytest.approx(1000 * pwm / 885, abs=2)
