"""``snakewalk trials``: a job over seeds, motions, robots and steepnesses."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.table import Table

from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.options import (
    DEFAULT_RUN,
    Json,
    RunName,
    TrackFile,
    World,
    console,
)

_HEADS = {
    "robot": "robot",
    "motion": "motion",
    "relief": "relief",
    "slope_deg": "slope\ndeg",
    "complete": "com-\nplete",
    "passed_by": "passed\nby",
    "duration_s": "time\ns",
    "path_error_m": "error\nm",
    "eta": "eta",
    "lead_max_rad": "lead\nrad",
    "current_max_a": "peak\nA",
    "roll_max_deg": "roll\ndeg",
    "in_air": "in\nair",
    "alarms": "ala-\nrms",
    "trips": "trips",
    "why": "why",
}
"""Columns of the table: the units stand under the names, so that it fits into 80 characters."""


def trials(
    run: RunName = DEFAULT_RUN,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="runs a row")] = 10,
    motion: Annotated[
        list[str] | None, typer.Option(help="may be given again; default: all")
    ] = None,
    robot: Annotated[
        list[str] | None, typer.Option(help="may be given again; default: the run's")
    ] = None,
    relief: Annotated[
        list[float] | None,
        typer.Option(min=0.0, max=5.0, help="factor on the ground's heights; may be given again"),
    ] = None,
    world: World = None,
    track: TrackFile = None,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    as_json: Json = False,
) -> None:
    """Simulate a job over seeds, motions, robots and relief; tabulate what was reached and why."""
    from snakewalk.controller.app.progress import show_progress  # noqa: PLC0415
    from snakewalk.controller.app.studies import trials as study  # noqa: PLC0415  heavy; --help stays quick

    require_extra("trials need", "mujoco")
    motions = motion or ["walk", "walk-printed", "walk-blind", "serpenoid"]
    cases = [
        study.Case(m, r, k)
        for r in (robot if robot else (None,))
        for k in (relief if relief else (1.0,))
        for m in motions
    ]
    changes = {"world": world, "track": track}
    for case in cases:
        study.prepare_case(run, case, 0, changes)  # refuse bad input before any process starts
    found = []
    for done in show_progress(
        study.trials(run, cases, seeds, workers, changes), run, len(cases) * seeds, transient=False
    ):
        found.append(done)
    rows = [asdict(one) for one in study.table(found, cases)]
    if as_json:
        print(json.dumps({"run": run, "table": rows, "trials": [asdict(t) for t in found]}))
        return
    shown = [key for key in _HEADS if any(row[key] not in {"", None} for row in rows)]
    if len({case.relief for case in cases}) == 1:
        shown.remove("relief")
    console.print(run)
    grid = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    for key in shown:
        text = key in {"robot", "motion", "why"}
        grid.add_column(_HEADS[key], justify="left" if text else "right", no_wrap=key != "why")
    for row in rows:
        grid.add_row(*["" if row[key] is None else str(row[key]) for key in shown])
    console.print(grid)
