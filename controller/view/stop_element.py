"""The E-STOP of the page: an element of our own, at a fixed place over everything else.

viser folds and moves its panels, and on a narrow screen leaves them out of sight.
"""

import asyncio
import json
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from websockets.exceptions import ConnectionClosed

from snakewalk.config import colours
from snakewalk.controller.view.fresh_line import Freshness

_STOP: Final = "stop"
_LATE: Final = "late"
_LOOK_S: Final = 0.05
"""Time between two looks at the state to be shown (ours)."""
_LATE_MAX: Final = 100


class StopElement:
    """State of the element in all browsers; ``serve`` runs in the page's server."""

    path = "/stop"
    script = Path(__file__).with_name("stop_element.js").read_text(encoding="utf-8")

    def __init__(self, freshness: Freshness) -> None:
        self._freshness = freshness
        freshness.on_late = self._note_late
        self.press: Callable[[str], str] = lambda who: "no run has begun yet"
        """Presses the run's button for a person or device; returns the line to show."""
        self._is_armed = False
        self._is_over = False
        self._lock = threading.Lock()
        self._state = ""
        self._late_s: deque[float] = deque(maxlen=_LATE_MAX)
        self.show("waiting for the run")

    def arm(self) -> None:
        """The run has begun: from now on it can be stopped."""
        self._is_armed = True
        self.show("torque off at once, latched")

    def show(self, text: str, color: str = "") -> None:
        """Show a line below the button; any thread may call it, and nothing hides the run's end."""
        row = {"text": text, "color": color, "armed": self._is_armed}
        with self._lock:
            if not self._is_over:
                self._state = json.dumps(row)

    def ended(self, text: str) -> None:
        """The run is over."""
        self._is_armed = False
        row = {"text": f"the run has ended: {text}", "color": colours.FAULT, "armed": False}
        with self._lock:
            self._is_over = True
            self._state = json.dumps(row)

    def pressed(self) -> None:
        """Press the run's button, and show the result."""
        self.show(self.press("E-STOP of the page"))

    def late_s(self) -> list[float]:
        """Return when the inputs began that were dropped since the last call."""
        return [self._late_s.popleft() for _ in range(len(self._late_s))]

    async def serve(self, connection: Any) -> None:
        """Show the state in one browser, and accept its E-STOP at any age."""
        shower = asyncio.create_task(self._show_in(connection))
        try:
            async for message in connection:
                connection.beginnings_s.clear()
                if message == _STOP:
                    self.pressed()
                elif not self._is_late(message):
                    break
        except ConnectionClosed:
            pass
        finally:
            shower.cancel()

    def _is_late(self, message: Any) -> bool:
        """Note an input that the browser has dropped; return whether the message says that."""
        word, _, age_ms = str(message).partition(" ")
        if word != _LATE or not age_ms.isdigit() or len(age_ms) > 9:
            return False
        self._note_late(self._freshness.now_s() - 1e-3 * int(age_ms))
        return True

    def _note_late(self, since_s: float) -> None:
        self._late_s.append(since_s)

    async def _show_in(self, connection: Any) -> None:
        shown = ""
        with suppress(ConnectionClosed):
            while True:
                state = self._state
                if state != shown:
                    shown = state
                    await connection.send(state)
                await asyncio.sleep(_LOOK_S)
