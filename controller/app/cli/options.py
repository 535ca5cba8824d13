"""What the commands share: options and the way a result is shown."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from snakewalk.controller.app.report.artifacts import Left

console = Console(highlight=False)
DEFAULT_RUN = "jacksboro-traverse"
RunName = Annotated[str, typer.Argument(help="shipped run, or a RUN.toml", show_default=True)]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
Seed = Annotated[int | None, typer.Option(help="of every random choice")]
Motion = Annotated[str | None, typer.Option(help="walk, walk-printed, walk-blind or serpenoid")]
Port = Annotated[
    str | None, typer.Option(help="serial port; default: the only USB adapter there is")
]
RunPort = Annotated[str | None, typer.Option(help="serial port; without it, the simulator")]
Film = Annotated[bool, typer.Option("--film/--no-film", help="draw a film of the run")]
RunFolder = Annotated[Path | None, typer.Option(file_okay=False, help="folder for log and summary")]
Force = Annotated[bool, typer.Option("--force", help="overwrite files")]
Robot = Annotated[str | None, typer.Option(help="shipped robot, or a TOML file")]
World = Annotated[str | None, typer.Option(help="shipped world, or a TOML file")]
TrackFile = Annotated[
    str | None, typer.Option("--track", help="shipped recording, or a file of midlines or angles")
]


def show(found: dict[str, object], as_json: bool) -> None:
    """Print a result as a table of two columns, or as JSON; in the table no value is a dash."""
    if as_json:
        print(json.dumps(found))
        return
    table = Table(box=None, show_header=False)
    for key, value in found.items():
        table.add_row(key.replace("_", " "), _said(value))
    console.print(table)


def _said(value: object) -> str:
    """A value for a reader: no brackets and quotes, no ``None``."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{key} {_said(one)}" for key, one in value.items()) or "-"
    if isinstance(value, list | tuple):
        return ", ".join(_said(one) for one in value) or "-"
    return "-" if value is None else str(value)


def leave(log: Path, folder: Path, *, film: bool, fine: bool = False) -> "Left":
    """Make report and film of a run; what could not be made is said on standard error."""
    from snakewalk.controller.app.report.artifacts import leave_report  # noqa: PLC0415  heavy; --help stays quick

    left = leave_report(log, folder, film=film, fine=fine)
    for line in left.notes:
        print(f"snakewalk: {line}", file=sys.stderr)
    return left
