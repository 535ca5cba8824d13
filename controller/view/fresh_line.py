"""The age of a browser's messages, without clocks that agree.

The server sends a ping ten times a second, and a browser answers each at once, in order with its
messages. A message therefore began later than the last ping whose answer came before it. A message
that waited in a stalled connection is older than permitted by this measure, and is dropped; the
connection is closed, and the browser shows the values in force when it is back.
"""

import asyncio
import itertools
import time
from collections import deque
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import DATA_OPCODES, Frame, Opcode

from snakewalk.controller.motion.command import LATE_S

_PERIOD_S = 0.1
_UNANSWERED_MAX = 100
"""Pings without an answer (ours): a stalled connection gets no more."""
_TRY_AGAIN = 1013
"""Code of a closed connection."""


class Freshness:
    """Oldest possible beginning of the messages of all browsers."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self.now_s = now_s
        self.on_late: Callable[[float], None] = lambda since_s: None
        """Function that gets the earliest beginning of a message that is dropped."""
        self._since_s: float | None = None

    def accept(self, since_s: float) -> None:
        """Note an accepted message that began at ``since_s`` or later."""
        before_s = self._since_s
        self._since_s = since_s if before_s is None else min(before_s, since_s)

    def take(self) -> float:
        """Return the earliest beginning of the messages since the last call, or now."""
        since_s = self._since_s
        self._since_s = None
        return self.now_s() if since_s is None else since_s


class FreshConnection(ServerConnection):
    """A connection to a browser that drops late messages."""

    def __init__(
        self, *args: Any, freshness: Freshness, late_paths: Collection[str], **options: Any
    ) -> None:
        """Open a connection; on ``late_paths`` late messages pass, and the receiver checks them."""
        super().__init__(*args, **options)
        self._freshness = freshness
        self._late_paths = late_paths
        self._pings_s: dict[bytes, float] = {}
        self._since_s = freshness.now_s()
        self._closing: asyncio.Task[None] | None = None
        self.beginnings_s: deque[float] = deque()
        """Earliest beginning of each message that was not received yet, if late ones pass."""

    @property
    def heard_s(self) -> float:
        """When the newest ping was sent that the browser has answered."""
        return self._since_s

    def process_event(self, event: Any) -> None:
        """Check a frame's age in the order of arrival."""
        if isinstance(event, Frame):
            if event.opcode is Opcode.PONG:
                self._note_answer(bytes(event.data))
            elif event.opcode in DATA_OPCODES and self._drops_frame(event):
                return
        super().process_event(event)

    def _note_answer(self, data: bytes) -> None:
        if data in self._pings_s:
            self._since_s = self._pings_s[data]
            self._pings_s = {k: at_s for k, at_s in self._pings_s.items() if at_s > self._since_s}

    def _drops_frame(self, frame: Frame) -> bool:
        assert self.request is not None
        if urlsplit(self.request.path).path in self._late_paths:
            if frame.fin:
                self.beginnings_s.append(self._since_s)
            return False
        if self._closing is None and self._freshness.now_s() - self._since_s > LATE_S:
            self._freshness.on_late(self._since_s)
            why = "a message came too late"
            self._closing = self.loop.create_task(self.close(_TRY_AGAIN, why))
        if self._closing is None:
            self._freshness.accept(self._since_s)
        return self._closing is not None

    async def prove(self) -> None:
        """Send pings until the connection is closed."""
        with suppress(ConnectionClosed):
            for number in itertools.count():
                if len(self._pings_s) < _UNANSWERED_MAX:
                    data = number.to_bytes(8, "big")
                    self._pings_s[data] = self._freshness.now_s()
                    await self.ping(data)
                await asyncio.sleep(_PERIOD_S)
