"""The E-STOP of the page: an element of our own, at a fixed place over everything else.

viser folds and moves its panels, and on a narrow screen leaves them out of sight. The element also
shows how old the newest values are, and the end of the run, after which nothing is served any more.
"""

import asyncio
import itertools
import json
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed

from snakewalk.config import colours
from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.operators import Operators

_POLL_S = 0.05
"""Time between two looks at the state to be shown (ours)."""
_BEAT_LOOKS = 5
"""Looks after which a state is sent again: a browser reports 1 s without one."""
_LATE_MAX = 100
_NAME_MAX = 9
"""Length of a tab's name, or of an age in ms."""


@dataclass(eq=False, slots=True)
class _Browser:
    connection: Any
    tab: str = ""
    """Name that stays when the page is loaded again."""
    shown: dict[str, Any] | None = None
    """State that it was sent last."""
    sent: bytes = b""
    """Report that it was sent last."""
    kept: bytes = b""
    """Report that it has confirmed."""


class StopElement:
    """State of the element in all browsers; ``serve`` runs in the page's server."""

    path = "/stop"
    script = Path(__file__).with_name("stop_element.js").read_text(encoding="utf-8")

    def __init__(self, freshness: Freshness) -> None:
        self._freshness = freshness
        freshness.on_late = self._note_late
        self.press: Callable[[str], str] = lambda sender: "no run has begun yet"
        """Presses the run's button for a person or device; returns the line to show."""
        self.operators = Operators(freshness.now_s)
        self.newest_s: float | None = None
        """When the newest values came from the run; None before the first."""
        self._lock = threading.Lock()
        self._state: dict[str, Any] = {
            "text": "waiting for the run",
            "color": "",
            "armed": False,
            "pressed": False,
            "over": False,
            "verdict": "",
        }
        self._report = b""
        self._report_ns = 0
        self._late_s: deque[float] = deque(maxlen=_LATE_MAX)
        self._browsers: set[_Browser] = set()

    def arm(self) -> None:
        """The run has begun: from now on it can be stopped."""
        self._set(text="torque off at once, latched", armed=True)

    def show(self, text: str) -> None:
        """Show a line below the button; any thread may call it, and nothing hides the run's end."""
        self._set(text=text)

    def ended(self, text: str) -> None:
        """The run is over; browsers keep the text when the server stops."""
        self._set(text=f"the run has ended: {text}", color=colours.FAULT, armed=False, over=True)

    def judged(self, verdict: str) -> None:
        """Show the verdict on the run below its end."""
        self._set(verdict=verdict, over=True)

    def offer(self, report: Path) -> None:
        """Send a report to the browsers, and send it again when it was written again."""
        with suppress(OSError):
            written_ns = report.stat().st_mtime_ns
            if written_ns != self._report_ns:
                self._report = report.read_bytes()
                self._report_ns = written_ns

    def pressed(self) -> None:
        """Press the run's button, and show the result."""
        self._set(text=self.press("E-STOP of the page"), pressed=True)

    def _set(self, **changed: Any) -> None:
        with self._lock:
            if changed.get("over") or not self._state["over"]:
                self._state = self._state | changed

    @property
    def has_browsers(self) -> bool:
        """Whether a browser is connected."""
        return bool(self._browsers)

    @property
    def is_shown(self) -> bool:
        """Whether every browser that is connected has the newest state and report."""
        return all(
            browser.shown is self._state and browser.kept is self._report
            for browser in list(self._browsers)
        )

    def late_s(self) -> list[float]:
        """Return when the inputs began that were dropped since the last call."""
        return [self._late_s.popleft() for _ in range(len(self._late_s))]

    async def serve(self, connection: Any) -> None:
        """Show the state in one browser, and accept its E-STOP at any age."""
        browser = _Browser(connection)
        self._browsers.add(browser)
        shower = asyncio.create_task(self._show_in(browser))
        try:
            async for message in connection:
                connection.beginnings_s.clear()
                if not self._take(browser, *str(message).partition(" ")[::2]):
                    break
        except ConnectionClosed:
            pass
        finally:
            self._browsers.remove(browser)
            shower.cancel()

    def _take(self, browser: _Browser, word: str, rest: str) -> bool:
        """Process a message of the script; return whether it is one."""
        if word == "stop":
            self.pressed()
        elif word == "kept":
            browser.kept = browser.sent
        elif word == "input":
            self.operators.note_input(browser.tab)
        elif len(rest) > _NAME_MAX:
            return False
        elif word == "tab":
            browser.tab = rest
        elif word == "late" and rest.isdigit():
            self._note_late(self._freshness.now_s() - 1e-3 * int(rest))
        else:
            return False
        return True

    def _note_late(self, since_s: float) -> None:
        self._late_s.append(since_s)

    async def _show_in(self, browser: _Browser) -> None:
        with suppress(ConnectionClosed):
            for look in itertools.count():
                state = self._state
                if state is not browser.shown or look % _BEAT_LOOKS == 0:
                    await browser.connection.send(json.dumps(state | {"age_ms": self._age_ms}))
                    browser.shown = state
                if browser.sent is not self._report:
                    browser.sent = self._report
                    await browser.connection.send(browser.sent)
                if browser.tab:
                    self.operators.hear(browser.tab, browser.connection.heard_s)
                await asyncio.sleep(_POLL_S)

    @property
    def _age_ms(self) -> int | None:
        newest_s = self.newest_s
        return None if newest_s is None else round(1e3 * (self._freshness.now_s() - newest_s))
