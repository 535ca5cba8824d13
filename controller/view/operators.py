"""Browsers that steer the run: without one, nobody is at its E-STOP."""

from collections.abc import Callable

from snakewalk.controller.runlog.row_line import SILENT_S, STEP_MAX_S

_RECENT_S = 2.0
"""Longest time from an input in a browser until its command is sent (ours)."""
_TABS_MAX = 1000
OPERATOR_LOST = "operator lost"
OPERATOR_BACK = "operator back"
"""Lines that the page sends to the run."""


class Operators:
    """Which browsers have steered, by the name of their tab, and which of them still answer.

    One that answers no ping for as long as an observer may be silent is lost; a reload is faster.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._input_s: dict[str, float] = {}
        self._heard_s: dict[str, float] = {}
        self._silent_s: dict[str, float] = {}
        self._checked_s = now_s()

    def hear(self, tab: str, at_s: float) -> None:
        """Note that a tab's connection answered what was sent at a time."""
        if tab in self._heard_s or len(self._heard_s) < _TABS_MAX:
            self._heard_s[tab] = max(at_s, self._heard_s.get(tab, at_s))

    def note_input(self, tab: str) -> None:
        """Note an input in a tab, which may become a command."""
        if tab in self._heard_s:
            self._input_s[tab] = self._now_s()

    def note_command(self) -> None:
        """Note that a command was sent to the run: the tabs with a recent input steer it."""
        since_s = self._now_s() - _RECENT_S
        for tab, at_s in self._input_s.items():
            if at_s >= since_s:
                self._silent_s.setdefault(tab, 0.0)

    def are_lost(self) -> bool:
        """Whether a browser that steers is gone; call it often."""
        now_s = self._now_s()
        step_s = min(now_s - self._checked_s, STEP_MAX_S)
        for tab, silent_s in self._silent_s.items():
            is_heard = self._heard_s[tab] > self._checked_s - STEP_MAX_S
            self._silent_s[tab] = 0.0 if is_heard else silent_s + step_s
        self._checked_s = now_s
        return any(silent_s > SILENT_S for silent_s in self._silent_s.values())
