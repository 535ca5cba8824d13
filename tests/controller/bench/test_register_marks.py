"""Marks of registers: each one is set, compared, kept or ignored, and the simulation obeys it."""

from functools import cache

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model, shipped_models
from snakewalk.controller.bench.register_checks import read_registers, register_findings
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, ChainError
from snakewalk.drivers.protocol.registers import ServoUnits
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.serve.servo_bus import ServoBus

MODELS = ("XM430-W350", "STS3215", "HLS3606", "SCS0009")


def test_each_writable_register_of_a_shipped_model_has_a_mark() -> None:
    unmarked = [
        f"{name}: {register}"
        for name in shipped_models()
        for register, row in servo_model(name).registers.items()
        if (row.range is not None) != (row.mark is not None)
    ]
    assert unmarked == []


def other_value(model: str, name: str) -> int:
    row = servo_model(model).registers[name]
    assert row.range is not None
    if name == "Drive Mode":
        return 12  # a run sets bits 2 and 3
    if row.mark == "fixed":
        return row.initial ^ 129
    low, high = row.range
    return low if low != row.initial else high


def a_robot(model: str) -> RobotConfig:
    volts = servo_model(model).motor
    assert volts is not None
    servo = {"model": model, "supply_v": volts.nominal_v}
    return RobotConfig.model_validate({"name": "two", "joint_axes": "yp", "servo": servo})


def a_bus(model: str) -> ServoBus:
    return ServoBus(f"1-2:{model}")


def a_chain(bus: ServoBus, robot: RobotConfig) -> ServoChain:
    return ServoChain(servo_bus(bus.line, robot.models_by_id, latency_s=0.004), robot)


def marked(*marks: str) -> list[tuple[str, str]]:
    return [(m, name) for m in MODELS for name in servo_model(m).marked(*marks)]


@pytest.mark.parametrize(("model", "name"), marked("fixed", "usual", "kept"))
def test_the_doctor_names_each_compared_register(model: str, name: str) -> None:
    bus = a_bus(model)
    robot = a_robot(model)
    servos = servo_bus(bus.line, robot.models_by_id, latency_s=0.004)
    units = JointUnits.of(robot, [ServoUnits.of(facts) for facts in robot.servo_records])

    def named() -> bool:
        findings = register_findings([read_registers(servos, robot, 2)], robot, units)
        texts = {"Homing Offset": "zero is moved", "PWM Limit": "move: PWM Limit"}
        return any(texts.get(name, name) in each.found for each in findings if each.grade != "ok")

    assert not named()
    bus.line.bank[name][1] = other_value(model, name)
    assert named()


@pytest.mark.parametrize(("model", "name"), marked("fixed"))
def test_a_run_does_not_start_with_another_scale_or_direction(model: str, name: str) -> None:
    bus = a_bus(model)
    bus.line.bank[name][1] = other_value(model, name)
    with pytest.raises(ChainError, match=rf"joint pitch_02 \(ID 2\): {name}\(\d+\) is \d+, not"):
        a_chain(bus, a_robot(model)).enable()
    assert bus["Torque Enable"].tolist() == [0, 0]


def test_bits_of_phase_that_the_driver_does_not_depend_on_are_free() -> None:
    """Boards differ in the voltage divider and the frequency of the PWM."""
    bus = a_bus("STS3215")
    bus.line.bank["Phase"][:] = 12 + 32 + 64
    a_chain(bus, a_robot("STS3215")).enable()


@cache
def set_by_a_run(model: str) -> dict[str, int]:
    bus = a_bus(model)
    a_chain(bus, a_robot(model)).enable()
    return {name: int(bus[name][1]) for name in servo_model(model).marked("set")}


@pytest.mark.parametrize(("model", "name"), marked("set"))
def test_a_run_sets_each_register_that_it_marks(model: str, name: str) -> None:
    bus = a_bus(model)
    if name != "Shutdown":  # a run sets the bits that protect the motor
        bus.set(name, other_value(model, name), ids=[2])
    chain = a_chain(bus, a_robot(model))
    chain.enable()
    assert int(bus[name][1]) == set_by_a_run(model)[name]


@cache
def motion(name: str, value: int, *, i_gain: int = 0, goal: int = 2400) -> Floats:
    """Angles, and reported positions, of an STS3215 that turns to a goal."""
    bus = ServoBus("1:STS3215")
    bus.load(0.2)
    bus.set("Position I Gain", i_gain)
    bus.set(name, value)
    bus.set("Torque Enable", 1)
    line = bus.line
    assert isinstance(line, FeetechLine)
    line.servos.write(0, 42, goal.to_bytes(2, "little"))
    samples = []
    for _ in range(25):
        line.clock.advance(0.01)
        samples.append(
            [float(line.servos.plant.position_rad[0]), float(bus["Present Position"][0])]
        )
    return np.array(samples)


OBEYED = [
    ("Min Position Limit", 2600),
    ("Max Position Limit", 2100),
    ("PWM Limit", 100),
    ("Phase", 12 | 128),
    ("Phase", 12 | 1),
    ("Phase", 12 | 129),
    ("Position P Gain", 8),
    ("Minimum Startup Force", 254),
    ("CW Dead Zone", 16),
    ("CCW Dead Zone", 16),
    ("Angular Resolution", 2),
    ("Homing Offset", 100),
    ("Operating Mode", 1),
    ("Acceleration", 5),
    ("Goal Velocity", 200),
    ("Goal PWM", 100),
]


@pytest.mark.parametrize(("name", "value"), OBEYED)
def test_a_simulated_feetech_servo_obeys_a_register(name: str, value: int) -> None:
    goal = 1700 if name == "CCW Dead Zone" else 2400
    usual = motion("Alarm LED", 47, goal=goal)
    assert np.abs(motion(name, value, goal=goal) - usual)[:, 0].max() > 1e-4


def test_an_integral_limit_bounds_the_integral() -> None:
    free, bounded = (motion("Integral Limit", limit, i_gain=200)[-1, 0] for limit in (0, 1))
    without = motion("Integral Limit", 0)[-1, 0]
    assert abs(bounded - without) < 0.2 * abs(free - without)


def test_a_resolution_of_two_turns_twice_as_far() -> None:
    turned_rad = motion("Angular Resolution", 2, goal=1124)[-1, 0]  # 2248 steps of the sensor
    assert turned_rad == pytest.approx(200 * 2 * np.pi / 4096, abs=0.1)


def test_a_reversed_sensor_alone_runs_away_and_with_the_motor_it_mirrors() -> None:
    away = motion("Phase", 12 | 128)[-1, 0]
    assert away > 0.8  # the goal is 0.54 rad
    mirrored = motion("Phase", 12 | 129)[-1]
    assert mirrored[0] == pytest.approx(-352 * 2 * np.pi / 4096, abs=0.1)
    assert mirrored[1] == pytest.approx(2400, abs=65)


def test_a_servo_that_another_program_turns_is_reported_before_it_is_taken_over() -> None:
    bus = ServoBus("1-2:STS3215")
    bus.set("Operating Mode", 1, ids=[2])
    bus.set("Goal Velocity", 500, ids=[2])
    bus.set("Torque Enable", 1, ids=[2])
    bus.line.clock.advance(0.3)
    chain = a_chain(bus, a_robot("STS3215"))
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    took = [line for line in events if "another program" in line]
    assert took == [
        "joint pitch_02 (ID 2): another program drives it at +0.74 rad/s, Operating Mode 1; "
        "this run sets it up"
    ]
    assert bus["Operating Mode"].tolist() == [0, 0]


def test_a_line_of_another_make_has_the_same_report() -> None:
    bus = ServoBus("1-2")
    bus.set("Operating Mode", 1, ids=[1])
    bus.set("Torque Enable", 1, ids=[1])
    chain = a_chain(bus, a_robot("XM430-W350"))
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    assert any("yaw_01 (ID 1): another program drives it at" in e for e in events)


def test_another_mode_of_a_servo_without_a_watchdog_is_noticed_within_a_round() -> None:
    bus = ServoBus("1-2:STS3215")
    chain = a_chain(bus, a_robot("STS3215"))
    goal_rad = chain.enable().position_rad

    def cycles(count: int) -> None:
        for _ in range(count):
            chain.write(JointCommand(bus.line.clock.now_s(), goal_rad))
            bus.line.clock.advance(0.02)
            chain.read()

    cycles(17)
    bus.line.bank["Operating Mode"][1] = 1
    with pytest.raises(BusError, match=r"pitch_02 \(ID 2\): Operating Mode is 1, was 0"):
        cycles(16)
