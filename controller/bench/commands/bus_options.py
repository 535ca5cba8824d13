"""Options and questions that several ``snakewalk bus`` commands have."""

import sys
from typing import Annotated

import typer

from snakewalk.config.errors import InputError

Ids = Annotated[list[int], typer.Option("--id", help="ID of a servo, 0 to 252; may be repeated")]
Baud = Annotated[int, typer.Option(help="current baud rate of the servos")]
Bauds = Annotated[
    list[int] | None,
    typer.Option(help="search only this baud rate; may be repeated; default: all"),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="show the changes and write nothing")]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="act without asking")]


def confirmed(action: str, question: str, *, as_json: bool) -> bool:
    """Ask a person before an action; whether the person agrees.

    Raises:
        InputError: nobody can be asked: a terminal is missing, or the output is for programs.

    """
    if as_json or not sys.stdin.isatty():
        reason = "--json: is for programs; leave it out" if as_json else "a terminal is missing"
        raise InputError(f"{action} asks first, but {reason}; nothing is changed; add --yes")
    return typer.confirm(question, default=False, err=True)
