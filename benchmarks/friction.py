"""``python -m benchmarks.friction``: planted frictions, found from a run's log, and the next run.

Each robot is simulated with frictions of its own, from half to two and a half times the world's,
and with servos, masses and horns that differ a little. Its physics has half the step of the
simulator that finds the friction, and a camera measures its links with noise. The next run is the
same gait, wound less and with more waves: its speed is forecast with the world's friction and
with the friction that was found.

With ``--mass`` each robot weighs 0.7 to 1.4 times what its file says, and the mass is found, too;
the next run lifts higher, and is forecast for the currents that it needs.
"""

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console

from benchmarks.rows import found_table
from benchmarks.shadow import planted
from snakewalk.config.arrays import Floats
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.identification.friction_fit import (
    FrictionLog,
    Resistance,
    fit_friction,
    with_mass,
    with_resistance,
)
from snakewalk.controller.studies.shadow.diagnosis import Goals, goals_of
from snakewalk.sim.physics.plant import FLOOR_STEP_S

NEXT = {"winding_rad": 0.5, "waves": 1.5}
NEXT_LIFTED = {"winding_rad": 0.5, "lift_rad": 0.2}


def goals_of_gait(gait: str, robot: str, seconds: float, parameters: dict[str, float]) -> Goals:
    """Goals that a gait's run sends."""
    prepared = prepare_gait(gait, robot=robot, seconds=seconds, parameters=dict(parameters))
    with TemporaryDirectory() as folder:
        return goals_of(
            run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False)).record
        )[0]


def links_seen(noise_m: float, seed: int, links_m: Floats) -> Floats:
    """Where a camera sees the links (T, L, 3)."""
    chance = np.random.default_rng([seed, 1])
    shift_m = np.zeros((len(links_m), 1, 3))
    shift_m[:, 0, :2] = noise_m * chance.standard_normal((len(links_m), 2))
    return np.asarray(links_m + shift_m)


def speed_m_s(log: FrictionLog) -> float:
    """Mean speed of the body ahead."""
    return float(log.motion[:, 0].mean())


def current_a(log: FrictionLog) -> float:
    """Mean size of the currents."""
    return float(np.abs(log.answers[0]).mean())


def forecast(goals: Goals, friction: Resistance, mass: float = 1.0) -> FrictionLog:
    """Simulate a run with a friction, and a mass over the file's."""
    world = with_resistance(goals.world, friction)
    goals = replace(goals, world=world, robot=with_mass(goals.robot, mass))
    return FrictionLog.simulated(goals, NO_DEVIATION)


def robot_of(goals: Goals, seed: int) -> Deviation:
    """Draw a robot on its ground."""
    healthy, _, _ = planted(goals.robot, "none", seed)
    chance = np.random.default_rng([seed, 2])
    along, across = np.exp(chance.uniform(math.log(0.5), math.log(2.5), 2))
    return replace(healthy, along=float(along), across=float(across))


def heavier(goals: Goals, robot: Deviation, seed: int) -> tuple[Deviation, float]:
    """Draw a robot's mass over its file's: what its links differ by is a part of it."""
    share = float(np.random.default_rng([seed, 3]).uniform(0.7, 1.4))
    file_kg, own_kg = np.array(goals.robot.link_masses_kg), robot.load_kg
    load_kg = (share - 1.0) * file_kg + (0.0 if own_kg is None else own_kg)
    return replace(robot, load_kg=load_kg), 1.0 + float(load_kg.sum() / file_kg.sum())


def finer(goals: Goals) -> Goals:
    """Return the same goals for physics of half the step."""
    step_s = 0.5 * (goals.run.physics_step_s or FLOOR_STEP_S)
    return replace(goals, run=goals.run.model_copy(update={"physics_step_s": step_s}))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.friction", description=__doc__)
    parser.add_argument("--gait", default="lateral-undulation")
    parser.add_argument("--robot", default="yaw16")
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--noise-mm", type=float, default=1.0, help="of the camera")
    parser.add_argument("--mass", action="store_true", help="find the mass as well")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args(arguments)
    goals = goals_of_gait(given.gait, given.robot, given.seconds, {})
    next_goals = goals_of_gait(
        given.gait, given.robot, given.seconds, NEXT_LIFTED if given.mass else NEXT
    )
    told = goals.world.friction
    console = Console(width=200)
    names = ("along", "across", "across_over_along", *["mass"] * given.mass)
    what = current_a if given.mass else speed_m_s
    within, off, forecasts = dict.fromkeys(names, 0), [], []
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        robot, true_mass = robot_of(goals, seed), 1.0
        if given.mass:
            robot, true_mass = heavier(goals, robot, seed)
        seen = partial(links_seen, 1e-3 * given.noise_mm, seed)
        log = FrictionLog.simulated(finer(goals), robot, seen)
        fit = fit_friction([replace(log, goals=goals)], mass=given.mass)
        true = {"along": told.along * robot.along, "across": told.across * robot.across}
        true |= {"across_over_along": true["across"] / true["along"], "mass": true_mass}
        every, mass = fit.found, 1.0
        if fit.mass is not None:
            every, mass = every | {"mass": fit.mass}, fit.mass.value
        words = []
        for name in names:
            found = every[name]
            inside = found.low <= true[name] <= found.high
            within[name] += inside
            words.append(
                f"{name} {true[name]:.4f}: {found.value:.4f} ({found.low:.4f} to {found.high:.4f})"
                f"{'' if inside else ' OUTSIDE'}"
            )
        off.append([abs(every[name].value / true[name] - 1.0) for name in names])
        is_so = what(FrictionLog.simulated(finer(next_goals), robot))
        told_so = what(forecast(next_goals, told))
        found_so = what(forecast(next_goals, fit.friction, mass))
        forecasts.append([told_so / is_so - 1.0, found_so / is_so - 1.0])
        before, after = forecasts[-1]
        console.print(
            f"seed {seed}: {'; '.join(words)}; next run's {what.__name__} {is_so:.4f}, forecast "
            f"{before:+.1%} with the files', {after:+.1%} with what was found",
            soft_wrap=True,
        )
    console.print(found_table(within, off))
    before, after = np.abs(forecasts).T
    console.print(
        f"{what.__name__} of the next run, off: {np.median(before):.1%} (most {before.max():.1%}) "
        f"with the files', {np.median(after):.1%} (most {after.max():.1%}) with what was found; "
        f"nearer in {(after < before).sum()} of {given.seeds}"
    )


if __name__ == "__main__":
    main()
