"""The notice that a command compiles loops at its first use, with progress."""

from collections.abc import Callable

from snakewalk.drivers.clock import WallClock

_EVERY_S = 3.0
"""Time between two lines of progress (ours)."""


class CompilationNotice:
    """Prints a line at the first compiled loop of a process, and then how many are compiled."""

    def __init__(self, print_line: Callable[[str], None]) -> None:
        self._print_line, self._clock = print_line, WallClock()
        self._count = 0
        self._next_s = 0.0

    def __call__(self, loop: str) -> None:
        """Count ``loop``, a dotted name."""
        self._count += 1
        now_s = self._clock.now_s()
        if self._count == 1:
            self._print_line(
                "compiling loops for this computer, once; in advance: snakewalk tools compile"
            )
            self._next_s = now_s + _EVERY_S
        elif now_s >= self._next_s:
            self._print_line(f"compiled {self._count} loops; last: {loop}")
            self._next_s = now_s + _EVERY_S
