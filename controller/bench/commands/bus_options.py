"""Options and questions that several ``snakewalk bus`` commands have."""

import sys
from typing import Annotated

import typer

Ids = Annotated[list[int], typer.Option("--id", help="ID of a servo, 0 to 252; may be repeated")]
Baud = Annotated[int, typer.Option(help="current baud rate of the servos")]


def confirmed(as_json: bool, question: str = "write this?") -> bool:
    """Ask a person, if there is one."""
    if as_json or not sys.stdin.isatty():
        print("snakewalk: nothing written; say --yes to write without asking", file=sys.stderr)
        return False
    return typer.confirm(question, default=False)
