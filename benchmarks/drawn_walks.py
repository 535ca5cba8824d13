"""``python -m benchmarks.drawn_walks``: walks over crops of the elevation model, drawn by chance.

The shipped runs stand on crops that somebody chose. Here the crop, the start and three waypoints
are drawn from a seed, and drawn again until the planner takes them: each point is 1.2 to 2.4 m from
the one before, with a turn of at most 115 degrees. Scale and limits are those of a shipped world.
"""

import argparse
import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.console import Console

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.studies.trials import Case, Trial, Value, parse_over, run_trial

LEG_M = 1.2, 2.4
TURN_RAD = 2.0
WITHIN_M = 2.8
ROWS, COLUMNS = 344, 403
"""Of the elevation model."""


def points_m(chance: np.random.Generator) -> Floats:
    """(4, 2) start and waypoints."""
    found = [chance.uniform(-WITHIN_M, WITHIN_M, 2)]
    ahead = float(chance.uniform(-math.pi, math.pi))
    while len(found) < 4:
        turned = ahead + float(chance.uniform(-TURN_RAD, TURN_RAD))
        step = chance.uniform(*LEG_M) * np.array([math.cos(turned), math.sin(turned)])
        if np.abs(found[-1] + step).max() < WITHIN_M:
            found.append(found[-1] + step)
            ahead = turned
        elif chance.random() < 0.1:
            return points_m(chance)
    return np.round(found, 2)


def draw(run: str, over: Mapping[str, Value], seed: int) -> tuple[Case, dict[str, Any], int]:
    """Draw a crop and points that the planner takes; how many were refused before."""
    chance, refused = np.random.default_rng(seed), 0
    rows, columns = _size(run)
    while True:
        keys = (
            *over.items(),
            ("world.ground.row", int(chance.integers(ROWS - rows))),
            ("world.ground.column", int(chance.integers(COLUMNS - columns))),
        )
        start, *waypoints = points_m(chance).tolist()
        changes: dict[str, Any] = {
            "start_m": tuple(start),
            "waypoints_m": tuple(map(tuple, waypoints)),
        }
        try:
            _ = prepare_walk(run, keys=dict(keys), **changes).path
        except InputError:
            refused += 1
        else:
            return Case(run, "walk", keys=keys), changes, refused


def _size(run: str) -> tuple[int, int]:
    ground = prepare_walk(run).world.ground
    if ground is None or ground.kind != "elevation":
        raise SystemExit(f"{run}: its ground is no elevation model")
    return ground.rows, ground.columns


def told(trial: Trial) -> str:
    """Return a line about a trial."""
    where = ", ".join(f"{key.split('.')[-1]} {value}" for key, value in trial.case.keys[-2:])
    end = f"complete in {trial.duration_s:.0f} s" if trial.complete else trial.cause
    slope = f"{trial.slope_median_deg:.1f} deg"
    return f"seed {trial.seed}: {where}; {slope}: {end}, {trial.missed} missed"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.drawn_walks", description=__doc__)
    parser.add_argument("--run", default="jacksboro-traverse", help="whose world and settings hold")
    parser.add_argument("--over", action="append", default=[], help="KEY=VALUE, as in trials")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1000)
    given = parser.parse_args()
    over = {key: values[0] for key, values in map(parse_over, given.over)}
    console, found = Console(width=200), list[Trial]()
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        case, changes, refused = draw(given.run, over, seed)
        trial = run_trial(case, seed, 0.0, changes)
        console.print(f"{told(trial)} ({refused} draws refused)")
        found.append(trial)
    complete = [trial for trial in found if trial.complete]
    causes = Counter(trial.cause for trial in found if not trial.complete)
    slopes = [trial.slope_median_deg for trial in found]
    console.print(
        f"{given.run}: {len(complete)} of {len(found)} complete, "
        f"{sum(trial.first_pass for trial in found)} at the first pass, "
        f"{sum(trial.missed for trial in found)} misses; "
        f"{np.mean([trial.duration_s for trial in complete]):.1f} s, "
        f"path error {np.mean([trial.path_error_m for trial in found]):.3f} m, "
        f"slope {np.median(slopes):.1f} deg ({min(slopes):.1f} to {max(slopes):.1f}); "
        f"{dict(causes)}"
    )


if __name__ == "__main__":
    main()
