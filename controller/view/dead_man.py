"""The dead man's button of a browser's gamepad, at the run's end: its release stops the body."""

import math
import time
from collections.abc import Callable

STALE_S = 0.3
"""A gamepad that sends nothing for this time is not held (ours)."""
_MOST_AHEAD_S = 0.1
"""A later time is not believed (ours): both processes read the same clock."""
HOLD = "pad="
"""Begins a state of a gamepad."""
WITHOUT = "pad=none"
"""Command that ends the need to hold a gamepad."""


def hold_command(is_held: bool, at_s: float) -> str:
    """Say that a gamepad was held, or was not, at a time of the machine's clock."""
    return f"{HOLD}{is_held:d}@{at_s:.3f}"


class DeadMan:
    """Whether the body may move: once a gamepad steers, its button has to be held.

    One that is gone or silent is not held.
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._until_s = math.inf

    @property
    def is_enabled(self) -> bool:
        """Whether the body may move."""
        return self._now_s() < self._until_s

    def process(self, commands: list[str]) -> list[str]:
        """Process the commands of a gamepad; returns the others, and those that are damaged."""
        return [
            command
            for command in commands
            if not command.startswith(HOLD) or not self._process(command)
        ]

    def _process(self, command: str) -> bool:
        """Whether a command of a gamepad is valid; a time in the future is not."""
        down, _, text = command.removeprefix(HOLD).partition("@")
        try:
            at_s = float(text) if text else 0.0
        except ValueError:
            return False
        if command == WITHOUT:
            self._until_s = math.inf
        elif down == "0":
            self._until_s = -math.inf
        elif down == "1" and text and at_s <= self._now_s() + _MOST_AHEAD_S:
            self._until_s = at_s + STALE_S
        else:
            return False
        return True
