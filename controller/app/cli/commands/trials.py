"""``snakewalk trials``: runs over seeds, motions, robots and steepnesses."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.table import Table

from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.options import DEFAULT_RUN, Json, TrackFile, World, console

_HEADS = {
    "run": "run",
    "robot": "robot",
    "motion": "motion",
    "relief": "relief",
    "slope_deg": "slope\ndeg",
    "complete": "com-\nplete",
    "first_pass": "first\npass",
    "passed_by": "mis-\nses",
    "duration_s": "time\ns",
    "path_error_m": "error\nm",
    "path_error_max_m": "worst\nm",
    "eta": "eta",
    "cost_of_transport": "cost",
    "in_air": "in\nair",
    "roll_max_deg": "roll\ndeg",
    "why": "why",
}
"""Columns of the table: the units stand under the names, so that the table stays narrow."""
_TEXT = {"run", "robot", "motion", "why"}


def trials(
    runs: Annotated[
        list[str] | None,
        typer.Argument(help=f"shipped runs, or RUN.toml [default: {DEFAULT_RUN}]", metavar="RUN"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="runs a row")] = 20,
    first_seed: Annotated[int, typer.Option(min=0, help="the others follow it")] = 0,
    start_spread: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="of the start in x and y, m; 0: not moved")
    ] = 0.04,
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
    """Simulate runs over seeds, motions, robots and relief; tabulate what was reached and why not.

    Each seed moves the start, so that its runs differ also where the motion takes no chances.
    """
    from snakewalk.controller.app.progress import show_progress  # noqa: PLC0415
    from snakewalk.controller.app.studies import trials as study  # noqa: PLC0415  heavy; --help stays quick

    require_extra("trials need", "mujoco")
    motions = motion or ["walk", "walk-printed", "walk-blind", "serpenoid"]
    cases = [
        study.Case(run, m, r, k)
        for run in (runs or [DEFAULT_RUN])
        for r in (robot if robot else (None,))
        for k in (relief if relief else (1.0,))
        for m in motions
    ]
    changes = {"world": world, "track": track}
    seen = range(first_seed, first_seed + seeds)
    planned = study.plan_trials(cases, seen, start_spread, changes)  # refuses bad input first
    some = study.trials(planned, workers, spread_m=start_spread, changes=changes)
    found = list(show_progress(some, "trials", len(planned), transient=False))
    rows = [asdict(one) for one in study.table(found, cases)]
    if as_json:
        settings = {"seeds": list(seen), "start_spread_m": start_spread}
        print(json.dumps(settings | {"table": rows, "trials": [asdict(t) for t in found]}))
        return
    shown = [key for key in _HEADS if any(row[key] not in {"", None} for row in rows)]
    if len({case.relief for case in cases}) == 1:
        shown.remove("relief")
    grid = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    for key in shown:
        text = key in _TEXT
        grid.add_column(_HEADS[key], justify="left" if text else "right", no_wrap=key != "why")
    for row in rows:
        grid.add_row(*["" if row[key] is None else str(row[key]) for key in shown])
    console.print(grid)
