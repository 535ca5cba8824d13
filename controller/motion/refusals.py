"""Reports of rejected commands, limited to a readable rate."""

from collections.abc import Callable

from snakewalk.config.plain_text import plain

QUIET_S = 1.0
"""Time after which the same line is reported again (ours)."""
LINES_MAX = 10
"""Lines per ``QUIET_S``; the others are counted (ours)."""
NAME_MAX = 100
"""Characters that are quoted of a name or a word (ours)."""
TEXT_MAX = 300
"""Characters of a line (ours): a command may contain a name of any length."""


class Refusals:
    """Passes on reasons for rejections, at a limited rate."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._last = ""
        self._last_s = 0.0
        self._begin_s = 0.0
        self._lines = self._unreported = 0

    def add(self, why: str, time_s: float) -> None:
        """Report a rejection at a time of the run, or count it."""
        self.step(time_s)
        text = plain(why if len(why) <= TEXT_MAX else f"{why[: TEXT_MAX - 3]}...")
        if text == self._last and time_s - self._last_s < QUIET_S:
            return
        self._last = text
        self._last_s = time_s
        if self._lines == 0:
            self._begin_s = time_s
        if self._lines == LINES_MAX:
            self._unreported += 1
            return
        self._lines += 1
        self._report(text)

    def step(self, time_s: float) -> None:
        """Report the number of counted rejections, once ``QUIET_S`` is over."""
        if self._lines and time_s - self._begin_s >= QUIET_S:
            if self._unreported:
                self._report(f"{self._unreported} more commands were rejected")
            self._lines = self._unreported = 0
