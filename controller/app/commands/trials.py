"""``snakewalk trials``: a job over seeds and motions."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from controller.app.commands.common import DEFAULT_RUN, Json, RunName, console


def trials(
    run: RunName = DEFAULT_RUN,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="runs a motion")] = 10,
    motion: Annotated[
        list[str] | None, typer.Option(help="may be given again; default: all")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    as_json: Json = False,
) -> None:
    """Simulate a job over many seeds and motions, and tabulate what was reached."""
    from controller.app.prepare import prepare  # noqa: PLC0415  heavy; --help stays quick
    from controller.app.trials import table  # noqa: PLC0415
    from controller.app.trials import trials as run_trials  # noqa: PLC0415

    motions = motion or ["walk", "walk-printed", "walk-blind", "serpenoid"]
    for name in motions:
        prepare(run, motion=name)  # refuse bad input before any process starts
    total = len(motions) * seeds
    found = []
    for done in track(
        run_trials(run, motions, seeds, workers),
        total=total,
        description=run,
        console=Console(stderr=True),
    ):
        found.append(done)
    rows = table(found)
    if as_json:
        print(json.dumps({"run": run, "table": rows, "trials": [asdict(t) for t in found]}))
        return
    shown = Table(*[key.replace("_", " ") for key in rows[0]], title=run)
    for row in rows:
        shown.add_row(*[str(value) for value in row.values()])
    console.print(shown)
