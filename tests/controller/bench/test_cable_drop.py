"""The voltage along a chain: cables are found from a wiggle, and where to inject power."""

import json

import numpy as np
import pytest

from snakewalk.config.loader import load_robot, shipped, with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench import supply_check
from snakewalk.controller.bench.cable_drop import (
    best_injection,
    cable_finding,
    drop_along,
    estimate_cables,
)
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.protection import SupplyAndAmbient
from snakewalk.sim.servo.supply import Cabling
from tests.helpers.command import snakewalk


def with_power(name: str, **power: object) -> RobotConfig:
    return with_keys(load_robot(name), {"power": power}, "test")


def readings(robot: RobotConfig, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(100, S) voltages as servos round them, and what they draw: a wiggle with other loads."""
    assert robot.power is not None
    rng, servos = np.random.default_rng(seed), robot.joint_count
    swing = np.abs(np.sin(np.arange(100) * 0.13))[:, None]
    drawn_a = 0.04 + swing * rng.uniform(0.1, 0.4, servos)
    cabling = Cabling.of(robot, robot.power)
    volts = np.array([cabling.servo_v(robot.servo.supply_v, 0.02, each) for each in drawn_a])
    return np.round(volts, 1), drawn_a * rng.normal(1.0, 0.05, drawn_a.shape)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("fed", [[1], [16], [1, 16], [8]])
def test_planted_cables_are_found_within_their_interval(seed: int, fed: list[int]) -> None:
    rng = np.random.default_rng([seed, *fed])
    planted = rng.uniform(0.015, 0.06) * rng.uniform(0.9, 1.1, 15)
    robot = with_power("yaw16", cables_ohm=planted.tolist(), inject_ids=fed)
    estimate = estimate_cables(*readings(robot, seed), Cabling.of(robot, robot.power))  # type: ignore[arg-type]
    assert estimate.usual_low_ohm <= planted.mean() <= estimate.usual_high_ohm
    assert estimate.usual_high_ohm - estimate.usual_low_ohm < 0.03
    assert estimate.bad == ()


@pytest.mark.parametrize(("cable", "fed"), [(1, [1]), (7, [1]), (12, [1]), (3, [16]), (9, [1, 16])])
def test_a_bad_plug_is_named(cable: int, fed: list[int]) -> None:
    planted = np.full(15, 0.03)
    planted[cable] = 0.6
    robot = with_power("yaw16", cables_ohm=planted.tolist(), inject_ids=fed)
    voltage_v, drawn_a = readings(robot)
    estimate = estimate_cables(voltage_v, drawn_a, Cabling.of(robot, robot.power))  # type: ignore[arg-type]
    assert estimate.bad == (cable,)
    assert estimate.low_ohm[cable] <= 0.6 <= estimate.high_ohm[cable]
    found = cable_finding(robot, voltage_v, drawn_a)
    assert found.grade == "fail"
    assert f"between servos {cable + 1} and {cable + 2}" in found.found


def test_a_servo_that_measures_too_little_is_no_bad_plug() -> None:
    voltage_v, drawn_a = readings(with_power("yaw16", cable_ohm=0.02))
    voltage_v[:, 9] -= 0.4
    assert cable_finding(load_robot("yaw16"), voltage_v, drawn_a).grade != "fail"


def test_the_advice_is_the_best_place_that_there_is() -> None:
    robot = with_power("yaw16", cable_ohm=0.055)
    voltage_v, drawn_a = readings(robot)
    found = cable_finding(load_robot("yaw16"), voltage_v, drawn_a)
    assert found.grade == "warn"
    assert "at ID 1 to" in found.found
    assert "assumed: power enters at ID 1" in found.found
    assert found.remedy.startswith("inject power at ID 1")  # 10 to 12: beyond the middle
    loads_a = np.full(16, 0.3)
    cabling = Cabling.of(robot, robot.power)  # type: ignore[arg-type]
    best = best_injection(cabling, robot.servo_ids, 12.0, loads_a)
    tried = [
        Cabling.of(robot, robot.power.model_copy(update={"inject_ids": (1, each)}))  # type: ignore[union-attr]
        .servo_v(12.0, 0.02, loads_a)
        .min()
        for each in range(2, 17)
    ]
    assert best.lowest_v == pytest.approx(max(tried))
    assert best.servo_ids == (2 + int(np.argmax(tried)),)


def test_servos_that_measure_no_current_still_tell_the_fall() -> None:
    voltage_v, drawn_a = readings(with_power("yaw16", cable_ohm=0.055))
    found = cable_finding(load_robot("yaw16"), voltage_v, np.full_like(drawn_a, np.nan))
    assert (found.grade, found.remedy) == ("warn", "feed the chain at both ends")


def wiggled(robot: RobotConfig, cabled: RobotConfig) -> list[Finding]:
    line = SimLine(
        ServoBank(robot.servo_ids, robot.servo_models, robot.servo.baud),
        BenchPlant(robot.joint_count),
        supply_and_ambient=SupplyAndAmbient.of(cabled),
    )
    return supply_check.supply_under_load(
        DynamixelBus(line, robot.models_by_id), robot, SafetyConfig()
    )


def test_a_simulated_chain_with_a_bad_plug_is_found_over_the_bus() -> None:
    robot = load_robot("yaw16")
    cables_ohm = [0.02] * 15
    cables_ohm[6] = 0.7
    (found,) = [
        each
        for each in wiggled(robot, with_power("yaw16", cables_ohm=cables_ohm))
        if each.check == "cables"
    ]
    assert found.grade == "fail"
    assert "the one between servos 7 and 8 has 0." in found.found


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("name", ["yaw16", "xl330-16", "horcrux14", "printed12"])
def test_shipped_robots_give_no_alarm(name: str) -> None:
    robot = load_robot(name)
    findings = wiggled(robot, robot)
    assert [each.check for each in findings] == ["supply under load", "cables"]
    assert {each.grade for each in findings} == {"ok"}


def test_robot_power_computes_every_shipped_robot() -> None:
    for name in shipped("robots"):
        robot = load_robot(name)
        drop = drop_along(robot, with_power(name).power, 0.1)  # type: ignore[arg-type]
        assert drop.cable_a[0] == pytest.approx(drop.drawn_a[1:].sum())
        assert (np.diff(drop.servo_v) < 0.0).all()


def test_robot_power_tells_where_to_inject() -> None:
    told = json.loads(snakewalk("robot", "power", "alternating16", "--json").stdout)
    assert told["lowest_id"] == 16
    assert told["lowest_v"] == told["servos"][-1]["voltage_v"]
    assert told["with 1 more"].startswith("at ID 1")
    assert len(told["servos"]) == 16
