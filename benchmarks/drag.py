"""``python -m benchmarks.drag``: planted drag of water, found from the log of a swim.

Each constant is drawn from half to two and a half times the world's. Robots and camera are those of
``benchmarks.friction``. The physics has half the step of the simulator that finds the drag.
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

from benchmarks.friction import finer, links_seen
from benchmarks.rows import found_table
from benchmarks.shadow import planted
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.identification.friction_fit import (
    RATIO,
    FrictionLog,
    fit_friction,
    resistance_of,
    with_resistance,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.drag", description=__doc__)
    parser.add_argument("--gait", default="anguilliform")
    parser.add_argument("--seconds", type=float, default=9.0)
    parser.add_argument("--linear", type=float, default=0.0, help="linear_along_m_s of the file")
    parser.add_argument("--seeds", type=int, default=6)
    given = parser.parse_args(arguments)
    prepared = prepare_gait(
        given.gait,
        robot="yaw16",
        world="pool",
        seconds=given.seconds,
        keys={"run.physics_step_s": 0.005, "world.ground.linear_along_m_s": given.linear},
    )
    with TemporaryDirectory() as folder:
        run = run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False))
    goals = FrictionLog.of(run.record).goals
    water, constants = resistance_of(goals.world)
    names = (*constants, RATIO)
    console = Console(width=200)
    within, off = dict.fromkeys(names, 0), []
    for seed in range(given.seeds):
        factors = np.exp(
            np.random.default_rng([seed, 2]).uniform(math.log(0.5), math.log(2.5), len(constants))
        )
        true = {k: float(getattr(water, k) * f) for k, f in zip(constants, factors, strict=True)}
        there = replace(goals, world=with_resistance(goals.world, water.model_copy(update=true)))
        robot, _, _ = planted(goals.robot, "none", seed)
        log = FrictionLog.simulated(finer(there), robot, partial(links_seen, 1e-3, seed))
        fit = fit_friction([replace(log, goals=goals)])
        true[RATIO] = true["drag_across"] / true["drag_along"]
        for name in names:
            within[name] += fit.found[name].low <= true[name] <= fit.found[name].high
        off.append([abs(fit.found[name].value / true[name] - 1.0) for name in names])
        console.print(f"seed {seed}: {true} {fit.found} {fit.together}", soft_wrap=True)
    console.print(found_table(within, off))


if __name__ == "__main__":
    main()
