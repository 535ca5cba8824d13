"""``snakewalk policy learn``: a wave with its feedback, learnt by CMA-ES."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, GivenRobot, GivenWorld, console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.learning.wave_search import search_wave


@command(
    "policy learn",
    examples=("policy learn -o mine.toml", "policy learn --seed 1 --workers 8 -o one.toml"),
    results=("out",),
)
def learn_policy(
    out: Annotated[Path, typer.Option("--out", "-o", help="the policy (.toml)")],
    robot: GivenRobot = "yaw16",
    world: GivenWorld = "flat",
    generations: Annotated[int, typer.Option(min=1, max=100_000)] = 24,
    population: Annotated[
        int, typer.Option(min=4, max=10_000, help="candidates of a generation")
    ] = 12,
    steps: Annotated[int, typer.Option(min=50, max=100_000, help="of 20 ms, in an episode")] = 250,
    seed: Annotated[int, typer.Option(min=0, help="of candidates and starts")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    force: Force = False,
) -> None:
    """Learn a wave with its feedback by CMA-ES, on episodes of the Gymnasium environment."""
    if out.suffix != ".toml":
        raise InputError(f"{out}: a policy's file ends in .toml")
    with ProgressBar(f"{robot} on {world}", generations) as bar:
        policy = search_wave(
            out.stem,
            robot=robot,
            world=world,
            generations=generations,
            population=population,
            steps=steps,
            seed=seed,
            workers=workers,
            on_progress=lambda done, mean_m: bar.update(done, note=f"{mean_m:.2f} m an episode"),
        )
    with atomic_write(out) as part:
        part.write_text(policy.toml(), encoding="utf-8")
    console.print(f"{out}: {policy.origin.steps} steps; snakewalk policy run {out}")
