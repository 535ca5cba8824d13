"""``snakewalk repertoire run``: a plan of recorded actions."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    Force,
    Json,
    Ros,
    RunFolder,
    RunPort,
    View,
    ViewAt,
    show,
)
from snakewalk.controller.console.progress import TimeBar, in_real_time
from snakewalk.controller.console.result_files import check_picture, run_folder
from snakewalk.controller.repertoire.commands.action_table import plots
from snakewalk.controller.repertoire.repertoire_planning import load_plan
from snakewalk.controller.repertoire.repertoire_run import RepertoireRun, run_name, run_route
from snakewalk.controller.run.finish import write_artifacts
from snakewalk.controller.run.watchers import Watchers, watched


@command(
    "repertoire run",
    examples=("repertoire run plan.json", "repertoire run plan.json --open-loop --json"),
    results=("picture",),
)
def run_plan(
    plan: Annotated[Path, typer.Argument(help="made by: snakewalk plan --with repertoire -o")],
    port: RunPort = None,
    open_loop: Annotated[
        bool, typer.Option("--open-loop", help="as planned, without looking where the body is")
    ] = False,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    film: Film = True,
    picture: Annotated[Path | None, typer.Option(help="draw predicted and measured way")] = None,
    out: RunFolder = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a plan on servos or in the simulator, and compare predicted with measured poses."""
    job = load_plan(plan, replan=not open_loop)
    with watched(view, view_at, ros) as watchers:
        found, complete = carry_out(job, port, out, film, picture, force, watchers)
    show({"plan": str(plan), **found}, as_json)
    if not complete and not open_loop:
        raise SystemExit(1)


def carry_out(
    job: RepertoireRun,
    port: str | None,
    out: Path | None,
    film: bool,
    picture: Path | None,
    force: bool,
    watchers: Watchers | None = None,
) -> tuple[dict[str, object], bool]:
    """Execute a job with a bar; what it did, and whether it reached every waypoint."""
    check_picture(picture)
    with (
        run_folder(run_name(job), out) as folder,
        TimeBar(job.run.name, job.route.duration_s) as progress,
    ):
        paced = watchers is not None and port is None
        on_progress = in_real_time(progress.on_progress) if paced else progress.on_progress
        ran = run_route(job, folder, port, on_progress, force=force, view=watchers)
    finished = ran.finished
    artifacts = write_artifacts(finished.record, folder, finished.summary, film=film)
    if picture is not None:
        plots().draw_route(job, finished.record, picture)
    return ran.to_dict() | {"log": str(finished.log)} | artifacts.to_dict(), ran.complete
