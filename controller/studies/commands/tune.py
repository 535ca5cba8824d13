"""``snakewalk gait tune``: better parameters of a gait, found on the physics."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from snakewalk.config.extras import require_extra
from snakewalk.config.key_types import SEED, Seed
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    Json,
    Robot,
    RunSeconds,
    Set,
    Workers,
    key_values,
    show,
)
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import check_ending, write_result
from snakewalk.controller.gaits.gait import fitting_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.studies import tune as search
from snakewalk.controller.studies.sweep_points import robot_file


@command(
    "gait tune",
    examples=("gait tune sidewinding --for speed --out mine.toml", "gait run mine.toml"),
    results=("out",),
)
def tune(
    gait: Annotated[
        str,
        typer.Argument(
            help="gait to search, from: snakewalk gait list", autocompletion=completion.GAITS
        ),
    ],
    aim: Annotated[
        Literal["speed", "efficiency"], typer.Option("--for", help="quantity to improve")
    ] = "speed",
    robot: Robot = None,
    set_: Set = None,
    budget: Annotated[int, typer.Option(min=16, help="number of runs of the search")] = 120,
    seeds: Annotated[int, typer.Option(min=1, help="number of other grounds to compare on")] = 5,
    seconds: RunSeconds = 10.0,
    seed: Seed = SEED,
    workers: Workers = 2,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="write the set of parameters for gait run here (.toml)"),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Search a gait's parameters for speed or efficiency, and compare with the defaults."""
    check_ending(out, "a set of parameters", ".toml")
    keys = key_values("--set", set_)

    require_extra("tuning needs", "mujoco")
    body = robot or fitting_robot([make_gait(gait).needs])
    body = robot_file(body) or body  # the set may lie in another folder
    with ProgressBar(f"{gait} for {aim}", budget) as bar:
        result = search.tune(
            gait,
            body,
            aim,
            search=search.Search(budget, seeds, seconds, seed),
            workers=workers,
            keys=keys,
            on_progress=bar.update,
        )
        bar.update(budget)
    facts: dict[str, object] = {
        "gait": gait,
        "robot": body,
        "for": aim,
        "runs": result.tried,
        "default": [round(value, 4) for value in result.default],
        "tuned": [round(value, 4) for value in result.best],
        "better_by": f"{result.margin:.0%}",
        "better_on": f"{result.better_seeds} of {seeds} grounds",
        "parameters": result.parameters,
    }
    if out is not None:
        lines = [
            f"# tuned for {aim}: {result.margin:+.0%} on {seeds} grounds",
            *(f"# with {key} = {json.dumps(value)}" for key, value in keys.items()),
            f"name = {json.dumps(out.stem, ensure_ascii=False)}",
        ]
        lines += [f"gait = {json.dumps(gait)}", f"robot = {json.dumps(body)}", "", "[parameters]"]
        lines += [f"{key} = {json.dumps(value)}" for key, value in result.parameters.items()]
        write_result(out, "\n".join(lines) + "\n")
        facts["set"] = str(out)
    show(facts, as_json)
