"""``snakewalk gait sweep``: gaits on the physics over many parameters."""

import json
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from snakewalk.config.key_types import SEED, Seed
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import (
    Dask,
    Force,
    Json,
    RunSeconds,
    Set,
    TableParquet,
    Workers,
    console,
    key_values,
    print_table,
)
from snakewalk.controller.console.parquet import check_parquet, table_to_parquet
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.studies.commands.pictures import pictures
from snakewalk.controller.studies.sweep_backends import open_backend
from snakewalk.controller.studies.sweep_points import plan_sweep
from snakewalk.controller.studies.sweep_table import KINDS, digest, read_table, table_rows
from snakewalk.controller.studies.sweep_table import SweepTable as Sweep

_HEADS = {
    "points": "n",
    "default_bl_cycle": "BL a\ncycle",
    "most_bl_cycle": "most",
    "default_pace": "pace",
    "most_pace": "most",
    "pace": "",
    "default_cost": "cost",
    "least_cost": "least",
    "peak_torque_n_m": "N m",
    "default_slip": "slip",
}
"""Columns of the printed table; the JSON has all."""


@command(
    "gait sweep",
    examples=(
        "gait sweep sidewinding rolling --points 30 -o sweep.csv --picture sweep.png",
        "gait sweep --dask tcp://cluster:8786 --points 5000 --parquet sweep.parquet",
    ),
    results=("picture", "parquet"),
    tables=("out",),
)
def sweep(
    gaits: Annotated[
        list[str] | None,
        typer.Argument(
            help="gaits to measure; default: all", metavar="GAIT", autocompletion=completion.GAITS
        ),
    ] = None,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            help="shipped robot, or a TOML file; may be repeated; default: yaw16 and alternating16",
            autocompletion=completion.ROBOTS,
        ),
    ] = None,
    set_: Set = None,
    points: Annotated[
        int, typer.Option(min=1, max=100_000, help="number of points per gait and robot")
    ] = 30,
    seconds: RunSeconds = 12.0,
    seed: Seed = SEED,
    workers: Workers = 2,
    dask: Dask = None,
    backend: Annotated[
        str, typer.Option(help="simulator: processes, warp, warp:DEVICE, or a plug-in")
    ] = "processes",
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="write the table here; runs that it contains are skipped"),
    ] = Path("sweep.csv"),
    picture: Annotated[
        Path | None, typer.Option(help="draw the table here (.png, .svg, .pdf)")
    ] = None,
    parquet: TableParquet = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Measure gaits over their parameters: speed, cost of transport, torque, heat, slip."""
    check_picture(picture)
    check_parquet(parquet)
    keys = key_values("--set", set_)

    simulator = open_backend(backend, workers, dask)
    planned = plan_sweep(gaits, robot, points, seed=seed, seconds=seconds, keys=keys)
    table = Sweep(out)
    for line in () if as_json else planned.left_out:
        console.print(f"left out: {line}", style="dim")
    refused: Counter[str] = Counter()
    missing = table.missing(planned.points)
    with table:
        for point, row in show_progress(
            simulator.measure(missing),
            str(out),
            len(planned.points),
            done=len(planned.points) - len(missing),
            transient=False,
        ):
            table.add(point, row)
            LOGGER.debug("%s", row)
            if row.ended.startswith("refused"):
                refused[row.ended] += 1
    for why, times in refused.items():
        LOGGER.warning("%d of %d points %s", times, len(missing), why)
    rows = (
        [asdict(digested_row) for digested_row in digest(table_rows(out))] if out.exists() else []
    )
    if picture is not None:
        pictures().draw_sweep(read_table(out) if out.exists() else [], picture)
    if parquet is not None and out.exists():
        table_to_parquet(out, parquet, KINDS)
    if as_json:
        facts = {"table": str(out), "run": len(missing), "held": len(planned.points)}
        print(json.dumps(facts | {"left_out": planned.left_out, "gaits": rows}))
    else:
        _show(out, rows)
    if missing and refused.total() == len(missing):
        raise SystemExit(1)


def _show(out: Path, rows: list[dict[str, Any]]) -> None:
    console.print(str(out))
    cells = [
        [f"{row['gait']} {row['robot']} {row['keys']}".rstrip(), *(row[key] for key in _HEADS)]
        for row in rows
    ]
    print_table(["gait, robot", *_HEADS.values()], cells)
