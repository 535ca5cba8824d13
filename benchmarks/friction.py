"""``python -m benchmarks.friction``: planted frictions, found from a run's log, and the next run.

Each robot is simulated with frictions of its own, from half to two and a half times the world's,
and with servos, masses and horns that differ a little. Its physics has half the step of the
simulator that finds the friction, and a camera measures its links with noise. The next run is the
same gait, wound less and with more waves: its speed is forecast with the world's friction and
with the friction that was found.
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
from rich.table import Table

from benchmarks.shadow import planted
from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.app.identification.friction_fit import FrictionLog, fit_friction
from snakewalk.controller.app.runs.execute import execute
from snakewalk.controller.app.runs.factory import prepare_gait
from snakewalk.controller.app.shadow.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.app.shadow.diagnosis import Goals, goals_of
from snakewalk.sim.physics.plant import FLOOR_STEP_S

NEXT = {"winding_rad": 0.5, "waves": 1.5}


def goals_of_gait(gait: str, robot: str, seconds: float, parameters: dict[str, float]) -> Goals:
    """Goals that a gait's run sends."""
    prepared = prepare_gait(gait, robot=robot, seconds=seconds, parameters=dict(parameters))
    with TemporaryDirectory() as folder:
        return goals_of(execute(prepared, Path(folder) / "run", stoppable=False).record)[0]


def links_seen(noise_m: float, seed: int, links_m: Floats) -> Floats:
    """Where a camera sees the links (T, L, 3)."""
    chance = np.random.default_rng([seed, 1])
    shift_m = np.zeros((len(links_m), 1, 3))
    shift_m[:, 0, :2] = noise_m * chance.standard_normal((len(links_m), 2))
    return np.asarray(links_m + shift_m)


def speed_m_s(goals: Goals, deviation: Deviation, friction: FrictionConfig | None = None) -> float:
    """Mean speed of the body ahead."""
    if friction is not None:
        goals = replace(goals, world=goals.world.model_copy(update={"friction": friction}))
    motion = FrictionLog.simulated(goals, deviation).motion
    return float(motion[:, 0].mean())


def robot_of(goals: Goals, seed: int) -> Deviation:
    """Draw a robot on its ground."""
    healthy, _, _ = planted(goals.robot, "none", seed)
    chance = np.random.default_rng([seed, 2])
    along, across = np.exp(chance.uniform(math.log(0.5), math.log(2.5), 2))
    return replace(healthy, along=float(along), across=float(across))


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
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args(arguments)
    goals = goals_of_gait(given.gait, given.robot, given.seconds, {})
    next_goals = goals_of_gait(given.gait, given.robot, given.seconds, NEXT)
    told = goals.world.friction
    console = Console(width=200)
    names = ("along", "across", "across_over_along")
    within, off, forecasts = dict.fromkeys(names, 0), [], []
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        robot = robot_of(goals, seed)
        seen = partial(links_seen, 1e-3 * given.noise_mm, seed)
        log = FrictionLog.simulated(finer(goals), robot, seen)
        fit = fit_friction([replace(log, goals=goals)])
        true = {"along": told.along * robot.along, "across": told.across * robot.across}
        true["across_over_along"] = true["across"] / true["along"]
        words = []
        for name in names:
            found = fit.found[name]
            inside = found.low <= true[name] <= found.high
            within[name] += inside
            words.append(
                f"{name} {true[name]:.4f}: {found.value:.4f} ({found.low:.4f} to {found.high:.4f})"
                f"{'' if inside else ' OUTSIDE'}"
            )
        off.append([abs(fit.found[name].value / true[name] - 1.0) for name in names])
        is_m_s = speed_m_s(finer(next_goals), robot)
        forecasts.append(
            [
                speed_m_s(next_goals, NO_DEVIATION, friction) / is_m_s - 1.0
                for friction in (told, fit.friction)
            ]
        )
        before, after = forecasts[-1]
        console.print(
            f"seed {seed}: {'; '.join(words)}; next run's speed {is_m_s:.4f} m/s, forecast "
            f"{before:+.1%} with the world's, {after:+.1%} with the found"
        )
    table = Table("", "inside its interval", "off, median", "off, most", box=None)
    for k, name in enumerate(names):
        column = np.array(off)[:, k]
        count = f"{within[name]} of {given.seeds}"
        table.add_row(name, count, f"{np.median(column):.1%}", f"{column.max():.1%}")
    console.print(table)
    before, after = np.abs(forecasts).T
    console.print(
        f"speed of the next run, off: {np.median(before):.1%} (most {before.max():.1%}) with the "
        f"world's friction, {np.median(after):.1%} (most {after.max():.1%}) with the found; nearer "
        f"in {(after < before).sum()} of {given.seeds}"
    )


if __name__ == "__main__":
    main()
