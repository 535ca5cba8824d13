"""``snakewalk tools schema``: JSON Schema of the TOML files."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from snakewalk.config.document import SCHEMAS, json_schema
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force
from snakewalk.controller.console.result_files import refuse_to_overwrite, write_result
from snakewalk.controller.motion.policy import Policy

if TYPE_CHECKING:
    from pydantic import BaseModel


SchemaName = Literal[
    "run",
    "robot",
    "world",
    "synthesis",
    "gait",
    "recording",
    "skin",
    "animal",
    "schedule",
    "faults",
    "servo",
    "policy",
]
"""Names of the schemas in ``models``, known before they are built."""


@command("tools schema", examples=("tools schema run", "tools schema robot -o robot.json"))
def schema(
    kind: Annotated[SchemaName, typer.Argument(help="kind of file")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="write the schema here")] = None,
    force: Force = False,
) -> None:
    """Print the JSON Schema of a TOML file; editors use it to complete and check the file."""
    refuse_to_overwrite([out], force)
    text = json.dumps(json_schema(kind, models()[kind]), indent=2)
    if out is None:
        print(text)
        return
    write_result(out, text + "\n")


def models() -> "dict[str, type[BaseModel]]":
    """Model of each kind of file."""
    return {**SCHEMAS, "policy": Policy}
