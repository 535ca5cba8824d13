"""The command line, run in the test's own process: another would import for two seconds."""

import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from typing import NamedTuple
from unittest.mock import patch

from snakewalk.controller.cli.main import main
from snakewalk.controller.console.plugins import builtin_plugins


class Ended(NamedTuple):
    """How a command ended, as ``subprocess`` names it."""

    returncode: int
    stdout: str
    stderr: str


def snakewalk(*words: str) -> Ended:
    """Run ``snakewalk WORDS...``; an exception that would be a traceback comes through."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        patch.object(sys, "argv", ["snakewalk", *words]),
        patch.dict("os.environ", {"COLUMNS": "200"}),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return Ended(code, out.getvalue(), err.getvalue())


def command_words() -> list[tuple[str, ...]]:
    """Return the words of the program itself, of each family, and of each command."""
    commands = [tuple(each.name.split()) for each in builtin_plugins() if each.kind == "command"]
    families = dict.fromkeys(words[:end] for words in commands for end in range(len(words)))
    return [*families, *commands]
