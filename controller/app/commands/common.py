"""What the commands share: options and the way a result is shown."""

import json
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

console = Console(highlight=False)

DEFAULT_RUN = "jacksboro-traverse"
RunName = Annotated[str, typer.Argument(help="shipped run, or a RUN.toml", show_default=True)]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
Seed = Annotated[int | None, typer.Option(help="of every random choice")]
Motion = Annotated[str | None, typer.Option(help="walk, walk-printed, walk-blind or serpenoid")]
Port = Annotated[
    str | None, typer.Option(help="serial port; default: the only USB adapter there is")
]
Robot = Annotated[str | None, typer.Option(help="shipped robot, or a TOML file")]
World = Annotated[str | None, typer.Option(help="shipped world, or a TOML file")]
TrackFile = Annotated[
    str | None, typer.Option("--track", help="shipped recording, or a file of midlines or angles")
]


def show(found: dict[str, object], as_json: bool) -> None:
    """Print a result as a table of two columns, or as JSON."""
    if as_json:
        print(json.dumps(found))
        return
    table = Table(box=None, show_header=False)
    for key, value in found.items():
        text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
        table.add_row(key.replace("_", " "), str(text))
    console.print(table)
