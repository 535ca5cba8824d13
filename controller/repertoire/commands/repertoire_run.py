"""``snakewalk gait repertoire run``: a plan of recorded actions."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import show
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.repertoire.commands.action_table import plots
from snakewalk.controller.repertoire.repertoire_planning import load_plan
from snakewalk.controller.repertoire.repertoire_run import RepertoireRun, RouteRun, run_name
from snakewalk.controller.run.results import FilmChoice, write_artifacts
from snakewalk.controller.run.run_for_user import run_for_user


@command(
    "gait repertoire run",
    examples=("gait repertoire run plan.json", "gait repertoire run plan.json --open-loop --json"),
    results=("picture",),
)
def run_plan(
    plan: Annotated[
        Path, typer.Argument(help="file written by: snakewalk plan --with repertoire -o")
    ],
    open_loop: Annotated[
        bool, typer.Option("--open-loop", help="play the plan without measuring where the body is")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="draw the predicted and the measured path")
    ] = None,
    *,
    options: RunOptions,
) -> None:
    """Run a plan on servos or in the simulator, and compare predicted with measured poses."""
    job = load_plan(plan, replan=not open_loop)
    facts, complete = run_route(job, picture, options)
    show({"plan": str(plan), **facts}, options.as_json)
    if not complete and not open_loop:
        raise SystemExit(1)


def run_route(
    job: RepertoireRun, picture: Path | None, options: RunOptions
) -> tuple[dict[str, object], bool]:
    """Execute a job with a bar; return its facts, and whether it reached every waypoint."""
    check_picture(picture)
    result = run_for_user(
        job, run_name(job), options, bar=TimeBar(job.run.name, job.route.duration_s)
    )
    with result.ending.noted():
        choice = FilmChoice() if options.film else None
        artifacts = write_artifacts(result.record, result.folder, result.summary, film=choice)
    if picture is not None:
        plots().draw_route(job, result.record, picture)
    ran = RouteRun(job, result)
    return ran.to_dict() | {"log": str(result.log)} | artifacts.to_dict(), ran.complete
