"""Pendulums of a simulated servo whose constants are known."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import Gearbox

PLANTED = {
    "torque_constant_n_m_a": 0.45,
    "resistance_ohm": 3.6,
    "armature_kg_m2": 0.0023,
    "dry_n_m": 0.012,
    "stribeck_n_m": 0.008,
    "stribeck_rad_s": 0.25,
    "viscous_n_m_s": 0.015,
    "stribeck_exponent": 2.0,
    "p_unit_per_rad": 0.0031,
}
MASS_KG, ARM_M, DELAY_S, TICK_RAD = 0.45, 0.12, 0.003, np.pi / 2048
Goal = Callable[[np.ndarray], np.ndarray]


def swing(
    p_gain: int,
    goal: Goal,
    off_s: float,
    weaker: float = 1.0,
    *,
    backlash_rad: float = 0.0,
    limit_a: float = np.inf,
    noise: np.random.Generator | None = None,
) -> PendulumLog:
    """Four seconds at 200 Hz by the servo bench of the simulator; torque off from ``off_s`` on.

    ``noise``: of the encoder, half a tick (s.d.) before it is rounded.
    """
    has = PLANTED
    gear = Gearbox(
        *(has["armature_kg_m2"], has["dry_n_m"], has["viscous_n_m_s"], has["stribeck_n_m"]),
        *(has["stribeck_rad_s"], 0.0, 0.0, 0.0),
        backlash_rad=backlash_rad,
    )
    time_s = np.arange(0.0, 4.0, 0.005)
    goals = goal(time_s)
    plant = BenchPlant(
        1,
        inertia_kg_m2=MASS_KG * ARM_M**2,
        dry_n_m=0.0,
        load_n_m=lambda q: -MASS_KG * GRAVITY_M_S2 * ARM_M * np.sin(q),
        gear=gear,
        step_s=5e-4,
    )
    kt = has["torque_constant_n_m_a"] * weaker
    drive = ServoDrive(
        torque_on=np.ones(1),
        goal_rad=np.zeros(1),
        p_gain_per_rad=np.array([p_gain * has["p_unit_per_rad"]]),
        pwm_limit=np.ones(1),
        supply_v=np.full(1, 7.4),
        resistance_ohm=np.array([has["resistance_ohm"]]),
        torque_constant_n_m_a=np.array([kt]),
        back_emf_v_s=np.array([kt]),
        current_limit_a=np.full(1, limit_a),
    )
    on = (time_s < off_s).astype(float)
    measured = np.empty_like(time_s)
    for k, until_s in enumerate(np.append(time_s[1:], time_s[-1])):
        measured[k] = plant.position_rad[0]
        drive.torque_on[:] = on[k]
        plant.advance(min(time_s[k] + DELAY_S, until_s), drive)
        drive.goal_rad[:] = goals[k]
        plant.advance(until_s, drive)
    if noise is not None:
        measured += noise.normal(0.0, 0.5 * TICK_RAD, len(measured))
    counts = np.round(measured / TICK_RAD) * TICK_RAD  # as the encoder tells it
    volts = np.full_like(time_s, 7.4)
    about = (Path("planted.json"), "xl330", MASS_KG, ARM_M, float(p_gain))
    return PendulumLog(*about, time_s, goals, counts, volts, on, limit_a)


@pytest.fixture(scope="session")
def logs() -> list[PendulumLog]:
    """Slow and quick swings at two gains, one of them let go at the top."""
    return [
        swing(400, lambda t: 1.4 * np.sin(2.0 * t) * np.sin(5.1 * t), 9.0),
        swing(200, lambda t: np.minimum(1.2 * t, 2.0), 2.2),
        swing(800, lambda t: 0.8 * np.sin(9.0 * t), 9.0),
    ]


def write(log: PendulumLog, path: Path) -> PendulumLog:
    """Write a recording as BAM's raw logs are."""
    columns = (log.time_s, log.goal_rad, log.position_rad, log.supply_v, log.torque_on)
    names = ("timestamp", "goal_position", "position", "input_volts", "torque_enable")
    rows = [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]
    about = {"mass": log.mass_kg, "length": log.arm_m, "kp": log.p_gain, "motor": log.actuator}
    if np.isfinite(log.current_limit_a):
        about["goal_current_a"] = log.current_limit_a
    path.write_text(json.dumps(about | {"entries": rows}))
    return replace(log, path=path)


@pytest.fixture(scope="session")
def files(logs: list[PendulumLog], tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("pendulum")
    return [write(log, folder / f"log{k}.json").path for k, log in enumerate(logs)]
