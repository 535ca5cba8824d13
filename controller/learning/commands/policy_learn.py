"""``snakewalk gait policy learn``: a wave with its feedback, learnt by CMA-ES."""

from pathlib import Path
from statistics import fmean
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_ROBOT, DEFAULT_WORLD
from snakewalk.config.errors import InputError
from snakewalk.config.key_types import SEED, Seed
from snakewalk.controller.console.command import command
from snakewalk.controller.console.interrupted_progress import read_progress
from snakewalk.controller.console.options import Force, GivenRobot, GivenWorld, Workers, console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import check_ending, write_result
from snakewalk.controller.learning.wave_search import (
    SearchProgress,
    search_progress,
    search_wave,
)


@command(
    "gait policy learn",
    examples=(
        "gait policy learn -o mine.toml",
        "gait policy learn --seed 1 --workers 8 -o one.toml",
    ),
    results=("out",),
)
def learn_policy(
    out: Annotated[Path, typer.Option("--out", "-o", help="write the policy here (.toml)")],
    robot: GivenRobot = DEFAULT_ROBOT,
    world: GivenWorld = DEFAULT_WORLD,
    generations: Annotated[
        int, typer.Option(min=1, max=100_000, help="number of generations")
    ] = 24,
    population: Annotated[
        int, typer.Option(min=4, max=10_000, help="number of candidates per generation")
    ] = 12,
    steps: Annotated[
        int, typer.Option(min=50, max=100_000, help="number of steps of 20 ms per episode")
    ] = 250,
    seed: Seed = SEED,
    workers: Workers = 2,
    resume: Annotated[
        bool, typer.Option("--resume", help="continue an interrupted search from OUT.part")
    ] = False,
    force: Force = False,
) -> None:
    """Learn a wave with feedback by CMA-ES, on episodes of the Gymnasium environment.

    Each generation is saved at once in OUT.part. --resume continues from there, with the same
    result as without the interruption.
    """
    check_ending(out, "a policy's file", ".toml")
    part_file = out.with_name(f"{out.name}.part")
    progress = search_progress(
        robot=robot, world=world, population=population, steps=steps, seed=seed
    )
    if resume:
        progress = _resumed_progress(part_file, progress)
    elif part_file.exists() and not force:
        raise InputError(
            f"{part_file}: holds an interrupted search; continue it with --resume, or start again "
            "with --force"
        )

    def save(progress: SearchProgress) -> None:
        write_result(part_file, progress.model_dump_json(indent=1))
        note = f"{fmean(progress.rewards_m[-1]):.2f} m an episode"
        bar.update(len(progress.rewards_m), note=note)

    with ProgressBar(f"{robot} on {world}", generations) as bar:
        bar.update(len(progress.rewards_m))
        try:
            policy = search_wave(
                out.stem, progress, generations=generations, workers=workers, on_progress=save
            )
        except (KeyboardInterrupt, SystemExit) as stop:
            if part_file.exists():
                stop.add_note(f"{part_file}: holds the generations so far; continue by --resume")
            raise
    write_result(out, policy.toml())
    part_file.unlink(missing_ok=True)
    console.print(f"{out}: {policy.origin.steps} steps in all; snakewalk gait policy run {out}")


def _resumed_progress(file: Path, asked: SearchProgress) -> SearchProgress:
    """Progress in a file.

    Raises:
        InputError: the file is missing or broken, or of a search with other arguments.

    """
    progress = read_progress(file, SearchProgress)
    before = progress.model_dump()
    now = asked.model_dump()
    other = [
        f"{file}: its search has {key} {before[key]}, asked for {now[key]}; give the same, or "
        "start again with --force"
        for key in before
        if key != "rewards_m" and before[key] != now[key]
    ]
    if other:
        raise InputError(other)
    return progress
