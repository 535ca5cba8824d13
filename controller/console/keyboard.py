"""Keys of the terminal, without waiting for a line or a key."""

import os
import select
import sys
from typing import Self

from snakewalk.config.errors import InputError

try:
    import termios
    import tty
except ImportError:  # Windows
    termios = tty = None  # type: ignore[assignment]

_NAMES = {
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[C": "right",
    "\x1b[D": "left",
    "\x1bOA": "up",
    "\x1bOB": "down",
    "\x1bOC": "right",
    "\x1bOD": "left",
    " ": "space",
    "k": "up",
    "j": "down",
    "l": "right",
    "h": "left",
}

_READS_MAX = 16
"""Reads of 256 characters in a call (ours): pasted text must not hold a cycle up."""


def names(text: str) -> list[str]:
    """Names of the keys in terminal characters; arrows are three characters each."""
    keys: list[str] = []
    position = 0
    while position < len(text):
        arrow = _NAMES.get(text[position : position + 3])
        if arrow is not None and text[position] == "\x1b":
            keys.append(arrow)
            position += 3
            continue
        if text[position] != "\x1b":
            keys.append(_NAMES.get(text[position], text[position]))
        position += 1
    return keys


class Keyboard:
    """A terminal in cbreak mode, as a context manager."""

    is_enabled = True
    """A keyboard has no dead man's button."""

    def __init__(self, descriptor: int | None = None) -> None:
        if termios is None:
            raise InputError("--live: reads keys on Linux and macOS only; use --view here")
        self._file = sys.stdin.fileno() if descriptor is None else descriptor
        if not os.isatty(self._file):
            raise InputError(
                "--live: reads keys from a terminal, but standard input is not a "
                "terminal; use --view"
            )
        self._before = termios.tcgetattr(self._file)
        self.gone: str | None = None
        """Why keys do not arrive any more, or None."""

    def __enter__(self) -> Self:
        tty.setcbreak(self._file)
        return self

    def __exit__(self, *raised: object) -> None:
        termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def pressed(self) -> list[str]:
        """Names of the keys pressed since the last call."""
        text = b""
        for _ in range(_READS_MAX):
            if self.gone is not None or not select.select([self._file], [], [], 0.0)[0]:
                break
            try:
                more = os.read(self._file, 256)
            except OSError:
                more = b""
            text += more
            if not more:
                self.gone = "keyboard: the terminal is closed, and its torque-off key with it"
        return names(text.decode(errors="ignore"))
