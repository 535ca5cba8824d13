"""``python -m benchmarks.friction_laws``: planted laws of friction, found from a run's log.

The robots, their frictions and the camera are those of ``benchmarks.friction``. Each robot is
simulated under each of the three laws, with half the step of the simulator that compares them. The
search begins with the friction and the law of the world's file. A log has the right law, a wrong
law, or no decision.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from benchmarks.friction import finer, links_seen, robot_of
from snakewalk.config.friction_law import LAWS, LawName
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.identification.friction_fit import FrictionLog
from snakewalk.controller.studies.identification.law_fit import LawFit, fit_laws
from snakewalk.controller.studies.shadow.diagnosis import Goals, goals_of

GAIT = "lateral-undulation"
ROBOT = "yaw16"
STEP_S = 0.005
"""Step of the simulator that compares the laws: good enough on a floor, and quick."""
NOISE_M = 1e-3
"""Noise of the camera."""


SHAPES: dict[str, tuple[dict[str, float], ...]] = {
    "one": ({},),
    "two": ({"winding_rad": 0.45, "waves": 1.0}, {"winding_rad": 1.1, "waves": 1.5}),
}
"""Parameters of the gait in each run of a robot."""


def goals_of_gait(gait: str, robot: str, seconds: float, parameters: dict[str, float]) -> Goals:
    """Return the goals that a gait's run sends."""
    prepared = prepare_gait(
        gait,
        robot=robot,
        world="flat",
        seconds=seconds,
        parameters=dict(parameters),
        keys={"run.physics_step_s": STEP_S},
    )
    with TemporaryDirectory() as folder:
        run = run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False))
    return goals_of(run.record)[0]


def found_law(runs: Sequence[Goals], law: LawName, seed: int) -> LawFit:
    """Compare the laws on the logs of a robot that a seed draws, on ground with a law."""
    robot = replace(robot_of(runs[0], seed), law=law)
    logs = []
    for number, goals in enumerate(runs):
        seen = partial(links_seen, NOISE_M, 1000 * number + seed)
        logs.append(replace(FrictionLog.simulated(finer(goals), robot, seen), goals=goals))
    return fit_laws(logs)


def outcome(fit: LawFit, law: LawName) -> str:
    """Return ``right``, ``wrong`` or ``cannot be told``."""
    if not fit.is_decided:
        return "cannot be told"
    return "right" if fit.best == law else "wrong"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.friction_laws", description=__doc__)
    parser.add_argument("--gait", default=GAIT)
    parser.add_argument("--robot", default=ROBOT)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--runs", choices=SHAPES, default="two", help="shapes of the gait")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args(arguments)
    runs = [
        goals_of_gait(given.gait, given.robot, given.seconds, shape) for shape in SHAPES[given.runs]
    ]
    console = Console(width=200)
    counts: dict[LawName, Counter[str]] = {law: Counter() for law in LAWS}
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        for law in LAWS:
            fit = found_law(runs, law, seed)
            told = outcome(fit, law)
            counts[law][told] += 1
            misfits = ", ".join(f"{name} {value:.1f}" for name, value in fit.misfit.items())
            console.print(f"seed {seed}, {law}: {told} ({misfits})")
    table = Table("law", "right", "cannot be told", "wrong", box=None)
    for law, count in counts.items():
        table.add_row(law, *(str(count[word]) for word in ("right", "cannot be told", "wrong")))
    console.print(table)


if __name__ == "__main__":
    main()
