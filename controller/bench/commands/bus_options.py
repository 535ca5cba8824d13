"""Options and questions that several ``snakewalk bus`` commands have."""

import sys
from typing import Annotated

import typer

from snakewalk.config.errors import InputError

Ids = Annotated[list[int], typer.Option("--id", help="ID of a servo, 0 to 252; may be repeated")]
Baud = Annotated[int, typer.Option(help="current baud rate of the servos")]


def confirmed(action: str, question: str, *, as_json: bool) -> bool:
    """Ask a person before an action; whether the person agrees.

    Raises:
        InputError: there is no person: no terminal, or an output for programs.

    """
    if as_json or not sys.stdin.isatty():
        reason = "--json is for programs" if as_json else "there is no terminal"
        raise InputError(f"{action} asks first, but {reason}; nothing is changed; add --yes")
    return typer.confirm(question, default=False, err=True)
