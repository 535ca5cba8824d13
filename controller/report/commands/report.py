"""``snakewalk log report``: the page and the film of a run, from its log alone."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import LOOK
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Force, Json, Look, Marked, RunLog, show
from snakewalk.controller.console.result_files import refuse_mixture
from snakewalk.controller.run.results import FilmChoice, check_look, write_artifacts


@command("log report", examples=("log report runs/flat-square-walk-seed0/log.mcap",))
def report(
    log: RunLog,
    out: Annotated[
        Path | None,
        typer.Option(file_okay=False, help="folder of the report; default: the log's folder"),
    ] = None,
    film: Annotated[bool, typer.Option("--film/--no-film", help="draw the film again")] = True,
    fine: Annotated[
        bool, typer.Option("--fine", help="draw the film in 1280 x 720, which is slow")
    ] = False,
    look: Look = LOOK,
    marks: Marked = True,
    folders: Annotated[
        bool, typer.Option("--folders", help="keep the folder names of your files in report.html")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make report.html, summary.json and film.mp4 again from a log."""
    check_look(look)
    record = open_log(log)
    folder = log.parent if out is None else out
    refuse_mixture(log, folder, force)
    choice = FilmChoice(look, fine, marks) if film else None
    artifacts = write_artifacts(record, folder, film=choice, folders=folders)
    if artifacts.report is None:
        raise SystemExit(2)
    files = artifacts.to_dict()
    summary = str(folder / "summary.json")
    show({"report": files["report"], "summary": summary, "film": files["film"]}, as_json)
