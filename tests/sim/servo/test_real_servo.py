"""The servo model against recordings of a real XL330 that swings a pendulum (Rhoban, bam)."""

import importlib.util
import json
from dataclasses import astuple
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from snakewalk.config.loader import load_robot, with_keys
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import GEARBOXES, MOTORS, friction_n_m, motors_of, p_gain_per_rad

XL330 = MOTORS["XL330-M288"]
GEAR = GEARBOXES["XL330-M288"]
LOGS = (
    *("kp200_lift_and_drop", "kp200_sin_sin", "kp400_lift_and_drop"),
    *("kp800_sin_sin", "kp800_up_and_down"),
)


@pytest.fixture(scope="module")
def pendulum() -> ModuleType:
    """The benchmark of the same name, which also prints each term's share."""
    path = Path(__file__).resolve().parents[3] / "benchmarks" / "pendulum.py"
    spec = importlib.util.spec_from_file_location("pendulum", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def log_path(folder: Path, name: str) -> Path:
    return folder / "xl330-logs" / f"{name}.json"


@pytest.mark.parametrize(
    "name", ["kp200_lift_and_drop", "kp400_lift_and_drop", "kp800_up_and_down"]
)
def test_output_register_follows_the_error_at_the_models_gain(shared_data: Path, name: str) -> None:
    log = json.loads(log_path(shared_data, name).read_text())
    keys = ("goal_position", "position", "load", "torque_enable")
    column = {key: np.array([entry[key] for entry in log["entries"]], float) for key in keys}
    load = np.where(column["load"] > 32_767, column["load"] - 65_536, column["load"])
    error_rad = column["goal_position"] - column["position"]
    fit = (column["torque_enable"] > 0) & (np.abs(load) < 800)
    slope = (error_rad[fit] @ load[fit]) / (error_rad[fit] @ error_rad[fit])
    assert slope == pytest.approx(p_gain_per_rad(int(log["kp"]), XL330) * XL330.full_pwm, rel=0.02)
    assert np.abs(load).max() <= XL330.full_pwm


def test_the_pendulum_is_followed_at_every_gain_and_thrice_as_well_as_without_friction(
    shared_data: Path, pendulum: ModuleType
) -> None:
    """Within 0.07 rad RMS on each log with torque on, one set of constants."""
    paths = [log_path(shared_data, name) for name in LOGS]
    shipped = [pendulum.errors(path, GEAR)[0] for path in paths]
    plain = [pendulum.errors(path, None)[0] for path in paths]
    assert max(shipped) < 0.07
    assert np.mean(shipped) < np.mean(plain) / 3.0


def test_friction_is_least_where_motor_and_load_pull_together_and_small_without_torque() -> None:
    gear, still = np.array(astuple(GEAR)), 0.0
    holds = friction_n_m(gear, still, 0.3, -0.3)
    lets_down = friction_n_m(gear, still, 0.3, 0.3)
    by_motor, by_load, by_load_slow = gear[5:8]
    assert holds - lets_down == pytest.approx(0.3 * 2.0 * min(by_motor, by_load))
    assert friction_n_m(gear, still, 0.0, 0.0) == gear[1] + gear[3]
    # a P gain of 100 pulls with 0.22 N m/rad: what sticks without torque is 0.13 rad there
    stiff = p_gain_per_rad(100, XL330) * 7.4 * XL330.torque_constant_n_m_a / XL330.resistance_ohm
    assert (gear[1] + gear[3]) / stiff < 0.13
    assert friction_n_m(gear, 10.0, 0.0, -0.3) == pytest.approx(gear[1] + 0.3 * by_load)
    slow = gear[1] + gear[3] + 0.3 * (by_load + by_load_slow)
    assert friction_n_m(gear, still, 0.0, -0.3) == pytest.approx(slow)


@pytest.mark.parametrize("name", ["kp200_lift_and_drop", "kp400_lift_and_drop"])
def test_it_swings_freely_once_torque_is_off(
    shared_data: Path, pendulum: ModuleType, name: str
) -> None:
    gain, log = pendulum.recording(log_path(shared_data, name))
    simulated = pendulum.simulate(gain, log, GEAR)
    free = log["torque_enable"] == 0
    swing, real = np.ptp(simulated[free]), np.ptp(log["position"][free])
    assert swing == pytest.approx(real, rel=0.3)
    assert abs(simulated[-1] - log["position"][-1]) < 0.2


def test_friction_and_data_sheet_agree_on_the_speed_without_load() -> None:
    """What is left of 5 V at the specified 103 rev/min drives the gears."""
    speed = XL330.no_load_rad_s
    w = np.linspace(0.1, 2.0 * speed, 4_000)
    volts = 5.0 - XL330.back_emf_v_s * w
    motor = XL330.torque_constant_n_m_a * volts / XL330.resistance_ohm
    gear = np.array(astuple(GEAR))
    friction = [friction_n_m(gear, *each, 0.0) for each in zip(w, motor, strict=True)]
    left = motor - np.array(friction) - GEAR.viscous_n_m_s * w
    reached = w[np.flatnonzero(left > 0.0)[-1]]
    assert reached == pytest.approx(speed, rel=0.1)


@pytest.mark.parametrize(
    ("volts", "stall_n_m", "stall_a", "rpm"),
    [(11.1, 3.8, 2.1, 43.0), (12.0, 4.1, 2.3, 46.0), (14.8, 4.8, 2.7, 57.0)],
)
def test_one_set_of_xm430_constants_gives_its_data_sheet_at_every_voltage(
    volts: float, stall_n_m: float, stall_a: float, rpm: float
) -> None:
    """E-manual XM430-W350, Specifications: torque, current and speed at three supplies."""
    motor = MOTORS["XM430-W350"]
    amps = volts / motor.resistance_ohm
    assert amps == pytest.approx(stall_a, rel=0.06)
    assert motor.torque_constant_n_m_a * amps == pytest.approx(stall_n_m, rel=0.06)
    assert volts / motor.back_emf_v_s * 60.0 / (2.0 * np.pi) == pytest.approx(rpm, rel=0.02)


def test_a_robots_file_changes_what_a_servo_does_not_who_it_is() -> None:
    """Its line: registers and limits of the model, torque and gain of the file."""
    robot = load_robot("xl330-16")
    own = {"torque_constant_n_m_a": 0.25, "resistance_ohm": 5.0, "p_unit_per_rad": 0.004}
    changed = with_keys(robot, {"servo.motor": own}, "mine")
    lines = [
        SimLine(
            ServoBank(each.servo_ids, each.servo_models),
            BenchPlant(each.joint_count),
            motors=motors_of(each),
        )
        for each in (robot, changed)
    ]
    plain, drive = (line.firmware.drive for line in lines)
    np.testing.assert_array_equal(lines[0].bank.table, lines[1].bank.table)
    assert (drive.torque_constant_n_m_a == 0.25).all()
    assert (drive.back_emf_v_s == 0.25).all()
    np.testing.assert_allclose(drive.resistance_ohm, 5.0)
    register = lines[1].bank["Position P Gain"]
    np.testing.assert_allclose(drive.p_gain_per_rad, 0.004 * register)
    assert (plain.resistance_ohm == XL330.resistance_ohm).all()
