"""Facts that commands of a user print as JSON, and tables of them."""

import json
import subprocess
import sys
from collections.abc import Sequence
from typing import Any, Final

PROGRAM: Final = "from snakewalk.controller.cli.main import main; main()"
"""Python code of the program."""


def snakewalk(*words: str) -> Any:
    """Run a command as a user does; its JSON.

    Raises:
        SystemExit: the command printed no JSON.

    """
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words, "--json"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    try:
        return json.loads(run.stdout)
    except json.JSONDecodeError:
        raise SystemExit(f"snakewalk {' '.join(words)}: {run.stderr.strip()}") from None


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
