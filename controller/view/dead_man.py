"""The dead man's button of a browser's gamepad, at the run's end: who lets go stops the body."""

import math
import time
from collections.abc import Callable
from typing import Final

STALE_S: Final = 0.3
"""A gamepad that says nothing for so long is not held (ours)."""
WITHOUT: Final = "pad=none"
"""Says that nobody has to hold a gamepad any more."""


def hold_command(held: bool, at_s: float) -> str:
    """Say that a gamepad was held, or was not, at a time of the machine's clock."""
    return f"pad={held:d}@{at_s:.3f}"


class DeadMan:
    """Whether the body may move: once a gamepad steers, somebody has to hold its button.

    One that is gone or silent is not held.
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._until_s = math.inf

    @property
    def held(self) -> bool:
        """Whether the body may move."""
        return self._now_s() < self._until_s

    def sort_out(self, commands: list[str]) -> list[str]:
        """Take what is said of the gamepad; returns the other commands."""
        others = []
        for command in commands:
            word, _, value = command.partition("=")
            if word == "pad":
                self._take(command, value)
            else:
                others.append(command)
        return others

    def _take(self, command: str, value: str) -> None:
        down, _, at_s = value.partition("@")
        if command == WITHOUT:
            self._until_s = math.inf
        elif down == "1":
            self._until_s = float(at_s) + STALE_S
        else:
            self._until_s = -math.inf
