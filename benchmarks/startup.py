"""CPU time of the program's start and of its help, against that of importing Typer and Rich."""

import resource
import subprocess
import sys

from benchmarks.command_facts import PROGRAM
from benchmarks.rows import Row
from snakewalk.controller.console.plugins import builtin_plugins

TITLE = "start of the program"
TRIES = 5
TYPER = ("-c", "import typer, rich")
REFERENCE = "import typer, rich"


def run() -> list[Row]:
    """Return a row for each start; the last one is the slowest help of all commands."""
    base_s = min(_cpu_s(*TYPER) for _ in range(TRIES))
    rows = [Row(REFERENCE, 1e3 * base_s, "ms")]
    starts = ("--help", "--version", "run --help")
    for words in starts:
        rows.append(_row(words, min(_start_s(words) for _ in range(TRIES)), base_s))
    names = [each.name for each in builtin_plugins() if each.kind == "command"]
    first = sorted(((_start_s(f"{name} --help"), name) for name in names), reverse=True)
    slowest = max((min(_start_s(f"{n} --help") for _ in range(TRIES)), n) for _, n in first[:5])
    rows.append(_row(f"slowest help of {len(names)} commands: {slowest[1]}", slowest[0], base_s))
    return rows


def _row(what: str, value_s: float, base_s: float) -> Row:
    return Row(what, 1e3 * value_s, "ms", REFERENCE, value_s / base_s)


def _start_s(words: str) -> float:
    return _cpu_s("-c", PROGRAM, *words.split())


def _cpu_s(*words: str) -> float:
    """Return the CPU time of a Python process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
