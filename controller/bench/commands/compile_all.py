"""``snakewalk tools compile``: compile all loops in advance."""

import importlib.util
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.bench.loop_compiler import compile_with_progress
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json, show


@command("tools compile", examples=("tools compile", "tools compile --runs"))
def compile_all(
    runs: Annotated[
        bool,
        typer.Option(
            "--runs", help="only the loops of runs and gaits: half of the time; others follow later"
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Compile all loops once, after installation, so that no later command waits for it."""
    if importlib.util.find_spec("numba") is None:
        raise InputError("compile: numba is not installed, and loops run uncompiled")
    show({"compiled_loops": compile_with_progress(runs=runs)}, as_json)
