"""``snakewalk trials validate``: published measurements, measured and simulated."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from snakewalk.config.extras import require_extra
from snakewalk.config.loader import shipped
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import check_picture, write_result
from snakewalk.controller.validation.comparison import Compared, compare, median_ratio
from snakewalk.controller.validation.measurement import PublishedResults, load_measurement
from snakewalk.controller.validation.page import (
    page_text,
    quantity_text,
    ratio_text,
    value_text,
)


@command(
    "trials validate",
    examples=(
        "trials validate",
        "trials validate lamprey prickleback --json",
        "trials validate my-robot.toml --picture ratios.png",
    ),
    results=("picture", "page"),
)
def validate(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            help="shipped measurements, or TOML files of your own; default: all shipped ones",
            metavar="FILE",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw the ratio of each row (.png, .svg, .pdf)")
    ] = None,
    page: Annotated[
        Path | None, typer.Option(help="write the results and their sources as a Markdown page")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Play published measurements in the simulator; exit code 1 if a row leaves its range.

    A row's state is ok if simulated / measured is within 0.8 to 1.25, and reported if it is within
    its stated range only.
    """
    check_picture(picture)
    require_extra("measurements need", "mujoco")
    loaded = [load_measurement(name) for name in files or shipped("measurements")]
    with ProgressBar(
        "measurements", sum(len(measurement.rows) for _, measurement in loaded)
    ) as bar:
        rows = compare(loaded, bar.advance)
    if picture is not None:
        from snakewalk.controller.validation.plots import draw_ratios  # noqa: PLC0415  an extra

        draw_ratios(rows, picture)
    if page is not None:
        write_result(page, page_text(loaded, rows))
    if as_json:
        print(json.dumps(_data(rows)))
    else:
        _print(loaded, rows)
    if any(row.state in {"outside", "failed"} for row in rows):
        raise typer.Exit(1)


def _data(rows: Sequence[Compared]) -> dict[str, Any]:
    ratio, count = median_ratio(rows)
    table = [
        asdict(row) | {"ratio": None if math.isnan(row.ratio) else row.ratio, "state": row.state}
        for row in rows
    ]
    return {"rows": table, "median_ratio": ratio if count else None, "median_rows": count}


def _print(loaded: Sequence[tuple[str, PublishedResults]], rows: Sequence[Compared]) -> None:
    for name, measurement in loaded:
        grid = Table(
            "row",
            "quantity",
            "measured",
            "simulated",
            "ratio",
            "kind",
            "state",
            title=f"{measurement.title} ({name})",
            title_justify="left",
            box=None,
            pad_edge=False,
            padding=(0, 1, 0, 0),
        )
        file_rows = [row for row in rows if row.file == name]
        for row in file_rows:
            grid.add_row(
                row.row,
                quantity_text(row),
                value_text(row, row.measured),
                value_text(row, row.simulated),
                ratio_text(row),
                row.kind,
                row.state,
            )
        console.print(grid)
        for row in file_rows:
            if row.state == "failed":
                console.print(f"{row.row}: {row.cause}", markup=False)
    ratio, count = median_ratio(rows)
    if count:
        console.print(
            f"median ratio of the {count} measured, travelling, unfitted rows: {ratio:.2f}"
        )
