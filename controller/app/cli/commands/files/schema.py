"""``snakewalk schema``: JSON Schema of the TOML files."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.app.cli import completion
from snakewalk.controller.app.cli.options import Force
from snakewalk.controller.app.result_files import atomic_write, refuse_to_overwrite


def schema(
    kind: Annotated[
        str,
        typer.Argument(
            help="run, robot, world, synthesis, gait, recording, skin, animal or faults",
            autocompletion=completion.words(
                *("run", "robot", "world", "synthesis", "gait", "recording", "skin", "animal"),
                "faults",
            ),
        ),
    ],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="write it here")] = None,
    force: Force = False,
) -> None:
    """Print the JSON Schema of a TOML file, with which editors complete and check it."""
    from snakewalk.config.document import SCHEMAS, json_schema  # noqa: PLC0415  --help stays quick

    if kind not in SCHEMAS:
        raise InputError(f"{kind}: no such file; there are {', '.join(SCHEMAS)}")
    refuse_to_overwrite([out], force)
    text = json.dumps(json_schema(kind), indent=2)
    if out is None:
        print(text)
        return
    with atomic_write(out) as part:
        part.write_text(text + "\n", encoding="utf-8")
