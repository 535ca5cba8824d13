"""``snakewalk setup``: from a new chain of servos to its first motion."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.bench.guided_setup import GuidedSetup
from snakewalk.controller.console.child_process import run_command
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import check_port_name


@command("setup", examples=("setup", "setup mine --port /dev/ttyUSB0"))
def setup(
    folder: Annotated[
        Path, typer.Argument(help="folder of the robot's files; an earlier setup goes on there")
    ] = Path("snake"),
    port: Annotated[
        str | None,
        typer.Option(
            callback=check_port_name, help="serial port, or a URL such as socket://pi:5000"
        ),
    ] = None,
) -> None:
    """Set up a new chain of servos, step by step, up to its first motion.

    Each step is a command, which is shown and asked about first. Nothing moves without a question.
    Stop at any question; the same command goes on there.
    """
    if not sys.stdin.isatty():
        raise InputError("setup: asks before each step, but a terminal is missing; run it in one")
    guide = GuidedSetup(folder, port, _ask_person, run_command)
    guide.carry_on()
    files = guide.files
    typer.echo(
        f"\n{files.robot} is ready. Next, a slalom on the floor; plan it first:\n"
        f"  snakewalk plan flat-slalom --robot {files.robot}\n"
        f"  snakewalk run flat-slalom --robot {files.robot} --port {files.port} --view"
    )


def _ask_person(question: str) -> str:
    """Return the answer of a person; the input's end stops the setup."""
    typer.echo(f"{question}: ", nl=False)
    try:
        return input().strip()
    except EOFError:
        raise SystemExit(0) from None
