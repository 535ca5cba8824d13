"""``python -m benchmarks.motor``: servo constants found from pendulums, and what they forecast.

Servos are drawn by seed: torque constant, resistance, inertia, P unit and each term of friction. A
pendulum of each is simulated with half the step and seen in counts of the encoder; what is found
goes into the robot's file. The next run is a gait of a robot of such servos, on physics of half the
step: its angles, currents and speed are forecast by the robot's file with the catalogue's constants
and by the file with those that were found.

With ``--logs FOLDER`` the servo is a real one: each of BAM's raw logs there is forecast by a file
whose constants are from the others.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.friction import finer, goals_of_gait
from benchmarks.rows import found_table
from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.deviation import NO_DEVIATION
from snakewalk.controller.studies.identification.friction_fit import FrictionLog
from snakewalk.controller.studies.identification.pendulum_fit import fit_pendulum, robot_error_deg
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog, read_pendulum_log
from snakewalk.controller.studies.identification.pendulum_swing import FINE_S, robot_swing_rad
from snakewalk.controller.studies.identification.servo_constants import (
    CONSTANTS,
    NAMES,
    ServoConstants,
    robot_with,
)
from snakewalk.controller.studies.shadow.diagnosis import Goals
from snakewalk.sim.servo.motor import motors_of

RANGES = {
    **{"torque_constant_n_m_a": (0.7, 1.3), "resistance_ohm": (0.8, 1.4)},
    **{"armature_kg_m2": (0.6, 1.4), "p_unit_per_rad": (0.8, 1.2)},
}
"""Times what the robot's file and the catalogue have."""
FRICTION = {
    **{"dry_n_m": (0.002, 0.02), "stribeck_n_m": (0.0, 0.01), "viscous_n_m_s": (0.003, 0.015)},
    **{"by_motor": (0.1, 0.35), "by_load": (0.05, 0.25), "by_load_slow": (0.0, 0.15)},
    **{"stribeck_rad_s": (0.1, 0.6), "delay_s": (0.0, 0.01)},
}
JUDGED = (
    *("torque_constant_n_m_a", "resistance_ohm", "armature_kg_m2", "dry_n_m", "viscous_n_m_s"),
    *("by_motor", "by_load", "p_unit_per_rad"),
)
TICK_RAD = math.tau / 4096


def drawn(robot: RobotConfig, seed: int) -> ServoConstants:
    """Draw the constants of a servo."""
    chance, motor = np.random.default_rng([seed, 7]), motors_of(robot)[0]
    values = {constant.name: constant.absent for constant in CONSTANTS} | {
        "torque_constant_n_m_a": motor.torque_constant_n_m_a,
        "resistance_ohm": motor.resistance_ohm,
        "armature_kg_m2": robot.armatures_kg_m2[0],
        "p_unit_per_rad": 4096.0 / math.tau / motor.p_gain_divisor / 885.0,
    }
    for name, ends in RANGES.items():
        values[name] *= float(np.exp(chance.uniform(*np.log(ends))))
    for name, (low, high) in FRICTION.items():
        values[name] = float(chance.uniform(low, high))
    unknown = np.full(len(NAMES), np.nan)
    return ServoConstants(np.array([values[name] for name in NAMES]), unknown, unknown, "xl330")


def pendulums(robot: RobotConfig, servo: ServoConstants, seconds: float) -> list[PendulumLog]:
    """Recordings at 200 Hz: slow, quick and sudden, at three gains, one let go at the top."""
    goals: tuple[tuple[int, Callable[[Floats], Floats], float], ...] = (
        (200, lambda t: np.minimum(1.2 * t, 2.0), 0.55 * seconds),
        (400, lambda t: 1.4 * np.sin(2.0 * t) * np.sin(5.1 * t), math.inf),
        (800, lambda t: 0.8 * np.sin(9.0 * t) * np.sin(0.7 * t), math.inf),
        (800, lambda t: np.sign(np.sin(4.0 * t)), math.inf),  # at times with all that it has
    )
    time_s, logs = np.arange(0.0, seconds, 0.005), []
    for gain, goal, off_s in goals:
        log = PendulumLog(
            *(Path("planted"), servo.actuator, 0.49, 0.1, float(gain), time_s, goal(time_s)),
            *(np.zeros_like(time_s), np.full_like(time_s, 7.4), (time_s < off_s).astype(float)),
        )
        angle_rad = robot_swing_rad(robot, log, servo, 0.5 * FINE_S)
        logs.append(replace(log, position_rad=np.rint(angle_rad / TICK_RAD) * TICK_RAD))
    return logs


def forecast(goals: Goals, robot: RobotConfig) -> FrictionLog:
    """Simulate what a robot does with a run's goals."""
    return FrictionLog.simulated(replace(goals, robot=robot), NO_DEVIATION)


def apart(one: FrictionLog, other: FrictionLog) -> tuple[float, float, float]:
    """Return how far two runs are apart: degrees and mA (RMS), and of the speed of ``other``."""
    current_a, angle_rad = np.sqrt(((one.answers - other.answers) ** 2).mean(axis=(1, 2)))
    speed, true = one.motion[:, 0].mean(), other.motion[:, 0].mean()
    return float(np.degrees(angle_rad)), 1e3 * float(current_a), abs(float(speed / true) - 1.0)


def real(console: Console, robot: RobotConfig, folder: Path, starts: int, hops: int) -> None:
    """Print each log's error, forecast by a file whose constants are from the other logs."""
    logs = [read_pendulum_log(path) for path in sorted(folder.glob("kp*.json"))]
    table = Table("recording", robot.name, "with constants from the others", box=None)
    errors = []
    for k, log in enumerate(logs):
        others = [*logs[:k], *logs[k + 1 :]]
        found = fit_pendulum(others, starts=starts, hops=hops)
        both = (robot, robot_with(robot, found))
        errors.append([robot_error_deg(each, log, found) for each in both])
        table.add_row(log.path.stem, *(f"{error:.2f}" for error in errors[-1]))
    table.add_row("mean", *(f"{error:.2f}" for error in np.mean(errors, axis=0)))
    console.print(table)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.motor", description=__doc__)
    parser.add_argument("--robot", default="xl330-16", help="of XL330-M288")
    parser.add_argument("--logs", type=Path, help="a folder of a real servo's recordings")
    parser.add_argument("--gait", default="lateral-undulation")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--hops", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args(arguments)
    console, robot = Console(width=160), load_robot(given.robot)
    if given.logs is not None:
        real(console, robot, given.logs, given.starts, given.hops)
        return
    goals = goals_of_gait(given.gait, given.robot, given.seconds, {})
    catalogue, within, off, errors = forecast(goals, robot), dict.fromkeys(JUDGED, 0), [], []
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        servo = drawn(robot, seed)
        planted = robot_with(robot, servo)
        found = fit_pendulum(
            pendulums(planted, servo, 4.0), seed=seed, starts=given.starts, hops=given.hops
        )
        for name in JUDGED:
            k = NAMES.index(name)
            within[name] += bool(found.low[k] <= servo.values[k] <= found.high[k])
        off.append([abs(found[name] / servo[name] - 1.0) for name in JUDGED])
        run = forecast(finer(goals), planted)
        errors.append(
            [apart(catalogue, run), apart(forecast(goals, robot_with(robot, found)), run)]
        )
        console.print(
            f"seed {seed}: next run off by "
            + " and ".join(
                f"{deg:.2f} degrees, {milliampere:.1f} mA, {speed:.1%} of the speed ({which})"
                for which, (deg, milliampere, speed) in zip(
                    ("catalogue", "found"), errors[-1], strict=True
                )
            )
        )
    console.print(found_table(within, off))
    table = Table("next run, median (most)", "catalogue", "found", "nearer", box=None)
    for k, (what, scale) in enumerate(
        (("angles, degrees", 1), ("currents, mA", 1), ("speed, %", 100))
    ):
        before, after = scale * np.array(errors)[:, :, k].T
        cells = (f"{np.median(each):.2f} ({each.max():.2f})" for each in (before, after))
        table.add_row(what, *cells, f"{(after < before).sum()} of {given.seeds}")
    console.print(table)


if __name__ == "__main__":
    main()
