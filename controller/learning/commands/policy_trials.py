"""``snakewalk trials policy``: policies compared with gaits."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean, stdev
from typing import Annotated

import typer

from snakewalk.config.extras import require_extra
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    FirstSeed,
    Json,
    RunSeconds,
    Seeds,
    Workers,
    print_table,
)
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.learning import policy_trials as study
from snakewalk.controller.learning.policy_trials import PolicyTrial, PolicyTrialResult


@command(
    "trials policy",
    examples=(
        "trials policy wave-cma wave-ppo lateral-undulation --first-seed 1000",
        "trials policy mine.toml wave-cma --world flat --world flat-friction-3 --json",
    ),
)
def policy_trials(
    motions: Annotated[
        list[str],
        typer.Argument(
            help="policies, gaits, sets of parameters, or their files",
            metavar="MOTION...",
            autocompletion=completion.POLICIES_OR_GAITS,
        ),
    ],
    world: Annotated[
        list[str] | None,
        typer.Option(
            help="shipped world, or a TOML file; may be repeated; default: flat",
            autocompletion=completion.WORLDS,
        ),
    ] = None,
    seeds: Seeds = 10,
    first_seed: FirstSeed = 0,
    seconds: RunSeconds = 12.0,
    workers: Workers = 2,
    as_json: Json = False,
) -> None:
    """Compare policies with gaits: each seed varies start, friction and supply equally for all."""
    require_extra("trials need", "mujoco")
    rows = [(motion, ground) for ground in world or ["flat"] for motion in motions]
    rows = list(dict.fromkeys(rows))  # repeated rows run once
    planned = [
        PolicyTrial(motion, ground, seed, seconds)
        for motion, ground in rows
        for seed in range(first_seed, first_seed + seeds)
    ]
    some = study.policy_trials(planned, workers)
    trial_results = list(show_progress(some, "trials", len(planned)))
    table = [
        _row(
            *row,
            [
                trial_result
                for trial_result in trial_results
                if (trial_result[0].motion, trial_result[0].world) == row
            ],
        )
        for row in rows
    ]
    if as_json:
        trials = [asdict(trial) | asdict(result) for trial, result in trial_results]
        print(json.dumps({"table": [asdict(row) for row in table], "trials": trials}))
        return
    heads = (
        "motion",
        "world",
        "m/s",
        "sd",
        "lengths\na cycle",
        "J/m",
        "course\nrad",
        "trips",
        "pose",
    )
    print_table(heads, (asdict(row).values() for row in table))


@dataclass(frozen=True, slots=True)
class _Row:
    """Means over the runs that did not trip; None where all have."""

    motion: str
    world: str
    speed_m_s: float | None
    speed_sd_m_s: float | None
    body_lengths_cycle: float | None
    energy_j_m: float | None
    course_rad: float | None
    """Root of the mean square: how far off x they went."""
    trips: int
    pose: str
    """Evidence of the poses, as the verdict states it: ``simulated``."""


def _row(
    motion: str, world: str, trial_results: list[tuple[PolicyTrial, PolicyTrialResult]]
) -> _Row:
    untripped = [result for _, result in trial_results if not result.is_tripped]
    speeds = [result.speed_m_s for result in untripped]
    pose = ", ".join({result.verdict.evidence: None for _, result in trial_results})
    if not untripped:
        return _Row(motion, world, None, None, None, None, None, len(trial_results), pose)
    return _Row(
        Path(motion).stem,
        world,
        round(fmean(speeds), 4),
        round(stdev(speeds), 4) if len(speeds) > 1 else None,
        round(fmean(result.body_lengths_cycle for result in untripped), 3),
        round(fmean(result.energy_j_m for result in untripped), 2),
        round(fmean(result.course_rad**2 for result in untripped) ** 0.5, 3),
        len(trial_results) - len(untripped),
        pose,
    )
