"""The servos' loops: the same bytes compiled and not, and those of the other way around."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from snakewalk.drivers.protocol.packet import encode_fast, fast_head
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo import bench, control_loops, profile, servo_loops
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import GEARBOXES


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function as it stands, without numba."""
    return getattr(function, "py_func", function)


BOTH = [pytest.param(lambda f: f, id="compiled"), pytest.param(plain, id="plain")]


@pytest.mark.parametrize("how", BOTH)
def test_a_fast_answer_is_what_servos_write_one_after_the_other(how: Any) -> None:
    table = np.random.default_rng(1).integers(0, 256, (5, 40), np.uint8)
    table[:, 7] = [0, 4, 0, 0, 1]
    rows, ids = np.array([3, 1, 4]), (13, 11, 14)
    shares = b"".join(bytes((9, i)) + bytes(8) for i in ids)
    packet = np.frombuffer(fast_head(len(shares)) + shares, np.uint8).copy()
    shape, block = np.array([8, 10, 0, 2]), np.array([20, 6, 7])
    how(servo_loops.fill_replies)(packet, shape, table, rows, block)
    parts = [
        (0x80 if table[row, 7] else 0, i, table[row, 20:26].tobytes())
        for row, i in zip(rows, ids, strict=True)
    ]
    assert packet.tobytes() == encode_fast(parts)


@pytest.mark.parametrize("how", BOTH)
def test_motion_is_shown_in_the_registers_units_little_endian(how: Any) -> None:
    table = np.zeros((2, 20), np.uint8)
    shafts = (np.array([1.0, -9.0]), np.array([-0.5, 0.25]), np.array([0.5, -2.0]))
    frame = np.array([[1.0, -1.0], [2048.0, 100.0]])
    places, units = np.array([0, 4, 8]), np.array([[0.25, 0.25], [1000.0, 1000.0]])
    current_units = np.array([[0.01, 0.01], [500.0, 500.0]])
    how(servo_loops.write_motion)(table, places, *shafts, frame, current_units, units)
    assert table[:, 0:2].copy().view("<i2")[:, 0].tolist() == [100, 500]  # the second at its limit
    assert table[:, 4:8].copy().view("<i4")[:, 0].tolist() == [-2, -1]
    assert table[:, 8:12].copy().view("<i4")[:, 0].tolist() == [2548, 2100]
    assert not table[:, 12:].any()


@pytest.mark.parametrize("how", BOTH)
def test_goals_within_limits_are_taken_and_others_leave_no_trace(how: Any) -> None:
    ticks, ids = [2000, -5, 5000], (2, 0, 1)
    entries = b"".join(
        bytes((i,)) + t.to_bytes(4, "little", signed=True) for i, t in zip(ids, ticks, strict=True)
    )
    table, goal_rad = np.full((3, 8), 0xEE, np.uint8), np.full(3, 7.0)
    taken = np.zeros(3, bool)
    limits, frame = (
        np.array([[-10, 0, 0], [10, 4095, 4095]]),
        np.array([[1.0, 1, -1], [0.0, 0, 1000]]),
    )
    how(servo_loops.accept_goals)(
        np.frombuffer(b"xx" + entries, np.uint8),
        np.array(ids),
        table,
        2,
        4,
        limits,
        frame,
        np.full(3, 1000.0),
        goal_rad,
        taken,
    )
    assert taken.tolist() == [True, False, True]
    assert table[:, 4:].copy().view("<i4")[:, 0].tolist() == [-5, -286331154, 2000]
    assert goal_rad == pytest.approx([-0.005, 7.0, -1.0])


@pytest.mark.parametrize("how", BOTH)
def test_a_sensor_goes_its_share_of_the_way(how: Any) -> None:
    celsius, heat_j = np.array([25.0, 40.0]), np.array([0.5, 0.0])
    how(servo_loops.warm_up)(celsius, heat_j, 0.05, 25.0, np.array([[6.0, 6.0], [0.1, 0.1]]))
    assert celsius.tolist() == pytest.approx([25.0 + 0.1 * 60.0, 40.0 - 0.1 * 15.0])


@pytest.mark.parametrize("how", BOTH)
def test_only_full_output_without_motion_counts_as_blocked(how: Any) -> None:
    """Held; turning; turned back by force; not full; without torque; full by its own limit."""
    blocked_s = np.full(6, 0.3)
    pwm = np.array([1.0, 1.0, -1.0, 0.9, 1.0, -0.5])
    limit = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.5])
    on = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 1.0])
    velocity = np.array([0.0, 2.0, 2.0, 0.0, 0.0, 0.0])
    longest_s = how(servo_loops.count_blocked)(
        blocked_s, 0.05, pwm, limit, on, velocity, np.full(6, 0.2)
    )
    assert blocked_s.tolist() == pytest.approx([0.35, 0.0, 0.35, 0.0, 0.0, 0.35])
    assert longest_s == pytest.approx(0.35)


@pytest.mark.parametrize("how", BOTH)
def test_bridges_draw_current_whichever_way_they_push(how: Any) -> None:
    assert how(servo_loops.supply_current_a)(np.array([0.5, -0.5]), np.array([2.0, 1.0])) == 1.5


@pytest.mark.parametrize("how", BOTH)
@pytest.mark.parametrize(
    ("celsius", "tenths", "wrong"),
    [(80.4, 120, False), (80.6, 120, True), (20.0, 94, True), (20.0, 161, True), (20.0, 95, False)],
)
def test_heat_and_supply_are_judged_in_the_registers_units(
    how: Any, celsius: float, tenths: int, wrong: bool
) -> None:
    sensors, hottest = np.array([20.0, celsius]), np.array([80, 80], np.uint8)
    supply_v = np.full(2, tenths / 10.0)
    least, most = np.array([95, 95], np.uint16), np.array([160, 160], np.uint16)
    assert how(servo_loops.out_of_range)(sensors, hottest, supply_v, least, most) == wrong


def test_control_loops_and_shafts_move_to_the_bit_as_their_python(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Position PID along a profile; velocity along a ramp; plain P, with and without a gearbox."""

    def moved() -> bytes:
        plant = BenchPlant(4, gear=[None, None, None, GEARBOXES["XL330-M288"]])
        line = SimLine(ServoBank([1, 2, 3, 4]), plant)
        bank = line.bank
        bank["Operating Mode"][:] = [3, 1, 5, 4]
        bank["Torque Enable"][:] = 1
        bank["Goal Current"][:] = 20
        for name, value in (("Position D Gain", 300), ("Position I Gain", 40)):
            bank[name][0] = value
        bank["Feedforward 1st Gain"][0] = bank["Feedforward 2nd Gain"][0] = 100
        bank["Profile Velocity"][0], bank["Profile Acceleration"][:2] = 60, 30
        line.firmware.apply_registers()
        bank["Goal Position"][:], bank["Goal Velocity"][1] = 2_600, 80
        line.firmware.apply_registers()
        line.clock.advance(0.3)
        line.settle()
        drive = line.firmware.drive
        return b"".join(each.tobytes() for each in (plant.position_rad, *drive.columns()))

    compiled = moved()
    for module, name in (
        *((bench, "_step"), (profile, "_advance")),
        *((control_loops, "_run_position"), (control_loops, "_run_velocity")),
    ):
        monkeypatch.setattr(module, name, getattr(module, name).py_func)
    assert moved() == compiled
