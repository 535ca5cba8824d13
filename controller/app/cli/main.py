"""``snakewalk``: runs the command line and says in a line, with an exit code, how it ended."""

import os
import sys
from itertools import pairwise
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import missing_extra
from snakewalk.controller.app.messages import plain
from snakewalk.drivers.errors import DriverError


def main() -> None:
    """Run the command line; bad input ends with exit code 2 and one line per fault."""
    # Pictures are drawn without a screen, by a context of our own; MuJoCo's import fails on a
    # choice that is not installed.
    os.environ["MUJOCO_GL"] = "disable"
    try:
        _check_words(sys.argv[1:])
        _tell_of_pipes(sys.argv[1:])
        from snakewalk.controller.app.cli.command_line import app  # noqa: PLC0415  an interrupt may come during it

        app(prog_name="snakewalk")
    except InputError as error:
        _end(2, *error.faults)
    except DriverError as error:
        _end(1, str(error))
    except ModuleNotFoundError as error:
        needed = missing_extra(error)
        if needed is None:
            raise
        _end(2, needed)
    except OSError as error:
        place = f"{Path(str(error.filename))}: " if error.filename else ""
        notes = getattr(error, "__notes__", [])  # of a run: what became of torque and log
        _end(1 if notes else 2, "; ".join([f"{place}{error.strerror or error}", *notes]))
    except KeyboardInterrupt:
        _end(130, "interrupted")
    except SystemExit as stop:
        notes = getattr(stop, "__notes__", [])
        if notes:
            _print_line("; ".join(["ended by a signal", *notes]))
        raise


def _check_words(words: list[str]) -> None:
    """Refuse names that are no text: libraries below crash on them.

    Raises:
        InputError: the bytes of a word are not UTF-8.

    """
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            shown = word.encode(errors="surrogateescape").decode(errors="backslashreplace")
            raise InputError(f"{shown}: this name is not UTF-8; rename the file") from None


def _tell_of_pipes(words: list[str]) -> None:
    """Say which inputs are named pipes: to open one waits until another program writes to it."""
    for before, word in pairwise(("", *words)):
        own = word.startswith(("/dev/", "/proc/")) or before == "--port"  # a shell's; or refused
        if not own and Path(word).is_fifo():
            _print_line(f"{word}: a named pipe: waits for a program that writes to it; ^C ends")


def _end(code: int, *lines: str) -> None:
    for line in lines:
        _print_line(line)
    raise SystemExit(code) from None


def _print_line(line: str) -> None:
    print(f"snakewalk: {plain(line)}", file=sys.stderr)
