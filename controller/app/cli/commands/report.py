"""``snakewalk report``: the page and the film of a run, from its log alone."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.app.cli.options import Json, leave, show


def report(
    log: Annotated[Path, typer.Argument(help="log.mcap of a run, or the .part of a killed one")],
    out: Annotated[
        Path | None, typer.Option(file_okay=False, help="folder; default: the log's")
    ] = None,
    film: Annotated[bool, typer.Option("--film/--no-film", help="draw the film again")] = True,
    fine: Annotated[bool, typer.Option("--fine", help="film in 1280 x 720; slow")] = False,
    as_json: Json = False,
) -> None:
    """Make report.html, summary.json and film.mp4 again from a log."""
    from snakewalk.controller.runlog.reader import read_log  # noqa: PLC0415  heavy; --help stays quick

    note = read_log(log).note
    if note:
        print(f"snakewalk: {log}: {note}", file=sys.stderr)
    left = leave(log, log.parent if out is None else out, film=film, fine=fine)
    if left.report is None:
        raise SystemExit(2)
    show(
        {
            "report": str(left.report),
            "summary": str(left.report.parent / "summary.json"),
            "film": None if left.film is None else str(left.film),
        },
        as_json,
    )
