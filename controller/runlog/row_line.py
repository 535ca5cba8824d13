"""Line between a run and an observer, such as its page: rows out, commands back.

The run never waits: it keeps rows that do not fit the socket, only the newest of each measurement,
and sends them on request. A slow, stopped or dead observer gets nothing. A request is a line of
text: an empty one requests the newest rows, any other is an operator's command, such as
``frequency_hz=0.4``.
"""

import json
import select
import socket
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from snakewalk.controller.motion.command import LINE_BYTES
from snakewalk.controller.runlog.topics import TABLES, PoseTable

BUTTON = "/button"
GAIT = "/gait"
COURSE = "/course"
PICTURE = "/picture"
VERDICT = "/verdict"
"""Topics of the line that are not in the log."""
KEPT = frozenset(
    {BUTTON, GAIT, COURSE, VERDICT, *(t.topic.name for t in TABLES if t.topic.watched == "all")}
)
"""Topics of which every row is sent, in order; of others the newest."""
SENT = KEPT | {PICTURE, *(t.topic.name for t in TABLES if t.topic.watched == "newest")}
_KEPT_MAX = 1000
_COMMANDS_MAX = 100
"""Commands that wait for the run; the oldest are dropped beyond it."""
_WAITING_BYTES = 4 * LINE_BYTES
"""Commands that wait for the socket in the observer (ours); the oldest are dropped beyond it."""
SILENT_S = 3.0
"""An observer without a request for this time does not respond (ours): it requests rows 20 times a
second, and on a busy machine late by a second."""
_START_S = 60.0
"""Longest time without a request before an observer has shown a cycle (ours): building a scene
needs seconds."""
STEP_MAX_S = 0.1
"""Largest part of the time between two checks that counts (ours)."""
_RECEIVE_BYTES = 1 << 18
_HEAD = 4
_END = b"\n"


class RunEnd:
    """The run's end of the line."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        line.setblocking(False)
        self._kept: deque[bytes] = deque(maxlen=_KEPT_MAX)
        self._newest: dict[str, bytes] = {}
        self._out = memoryview(b"")
        self._ready = False
        self._in = bytearray()
        self._in_bytes = 0
        self._commands: deque[str] = deque()
        self._rejected: deque[str] = deque(maxlen=_COMMANDS_MAX)
        self._requests = 0
        self._owes_request = True
        self._silent_s = self._checked_s = 0.0
        self.is_closed = False
        """Whether the observer has closed its end, or has died."""

    def add(self, topic: str, row: bytes) -> None:
        """Accept a row; a cycle is complete with its pose."""
        if topic not in SENT:
            return
        if topic in KEPT:
            self._kept.append(_message(topic, row))
        else:
            self._newest[topic] = row
        if topic in KEPT or topic == PoseTable.topic.name:
            self.pump()

    def pump(self) -> None:
        """Send what the observer can receive now; never waits."""
        try:
            self._receive()
            while self._read_next():
                self._out = self._out[self._line.send(self._out) :]
        except BlockingIOError:
            return
        except OSError:  # the observer is gone: the run continues
            self.is_closed = True
            self._kept.clear()
            self._newest.clear()
            self._out = memoryview(b"")

    def commands(self) -> list[str]:
        """Return the commands that have arrived since the last call; never waits."""
        with suppress(OSError):
            self._receive()
        commands = list(self._commands)
        self._commands.clear()
        return commands

    def rejected(self) -> list[str]:
        """Return why lines were rejected since the last call."""
        reasons = list(self._rejected)
        self._rejected.clear()
        return reasons

    def is_silent(self, now_s: float) -> bool:
        """Whether the observer has not asked for rows for too long, although it was sent some.

        Call it in every cycle; time in which the run itself stands still does not count.
        """
        if self._owes_request:
            self._silent_s += min(max(now_s - self._checked_s, 0.0), STEP_MAX_S)
        self._checked_s = now_s
        return self._silent_s > (SILENT_S if self._requests > 1 else _START_S)

    def close(self, patience_s: float) -> None:
        """Send the last rows, for at most ``patience_s`` to a slow observer; then close."""
        self._ready = True
        self._line.settimeout(patience_s)
        while self._read_next():
            try:
                self._out = self._out[self._line.send(self._out) :]
            except OSError:
                break
        self._line.close()

    def _read_next(self) -> bool:
        if len(self._out):
            return True
        if self._kept:
            self._out = memoryview(self._kept.popleft())
        elif self._ready and self._newest:
            rows = sorted(self._newest.items(), key=lambda row: row[0] == PoseTable.topic.name)
            self._out = memoryview(b"".join(_message(topic, row) for topic, row in rows))
            self._newest = {}
            self._ready = False
            self._owes_request = True
        return len(self._out) > 0

    def _receive(self) -> None:
        try:
            data = self._line.recv(_RECEIVE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            self.is_closed = True
            raise
        if not data:
            self.is_closed = True
            return
        first, *others = data.split(_END)
        self._collect(first)
        for part in others:
            self._end_line()
            self._collect(part)

    def _collect(self, part: bytes) -> None:
        """Store a part of a line, and nothing of a line that is too long."""
        self._in_bytes += len(part)
        if self._in_bytes <= LINE_BYTES:
            self._in += part
        else:
            self._in.clear()

    def _end_line(self) -> None:
        size = self._in_bytes
        line = bytes(self._in)
        self._in_bytes = 0
        self._in.clear()
        if size > LINE_BYTES:
            self._rejected.append(
                f"a command of {size / 1e6:.1f} MB; at most {LINE_BYTES / 1e6:.1f} MB is accepted"
            )
        elif not line:
            self._ready = True
            self._requests += 1
            self._owes_request = False
            self._silent_s = 0.0
        else:
            self._commands.append(line.decode(errors="replace"))
            if len(self._commands) > _COMMANDS_MAX:
                self._commands.popleft()
                self._rejected.append(
                    f"more than {_COMMANDS_MAX} commands at once; the oldest are dropped"
                )


class ObserverEnd:
    """The observer's end of the line; it does not wait until the run receives."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        line.setblocking(False)
        self._in = bytearray()
        self._out = memoryview(b"")
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0

    def ask(self) -> None:
        """Ask for the newest rows."""
        self._send(_END)

    def command(self, text: str) -> None:
        """Send a command, of one line."""
        self._send(text.replace("\n", " ").encode(errors="replace") + _END)

    def rows(self, wait_s: float) -> Iterator[tuple[str, dict[str, Any]]]:
        """Topics and rows that have come, waiting at most ``wait_s`` for the first.

        Raises:
            EOFError: the run has closed the line.

        """
        self._flush()
        to_send = [self._line] if self._has_more else []
        readable, writable, _ = select.select([self._line], to_send, [], wait_s)
        if writable:
            self._flush()
        if not readable:
            return
        try:
            data = self._line.recv(_RECEIVE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            raise EOFError
        self._in += data
        while len(self._in) >= _HEAD:
            end = _HEAD + int.from_bytes(self._in[:_HEAD], "little")
            if len(self._in) < end:
                return
            topic, _, row = bytes(self._in[_HEAD:end]).partition(b"\0")
            del self._in[:end]
            yield topic.decode(), json.loads(row)

    @property
    def _has_more(self) -> bool:
        return bool(len(self._out) or self._waiting)

    def _send(self, line: bytes) -> None:
        self._waiting.append(line)
        self._waiting_bytes += len(line)
        while self._waiting_bytes > _WAITING_BYTES:
            oldest = next(k for k, row in enumerate(self._waiting) if row != _END)
            self._waiting_bytes -= len(self._waiting[oldest])
            del self._waiting[oldest]
        self._flush()

    def _flush(self) -> None:
        """Send what fits now; a line is never sent in part only."""
        with suppress(OSError):  # full, or the run is gone: ``rows`` reports it
            while self._has_more:
                if not len(self._out):
                    line = self._waiting.popleft()
                    self._waiting_bytes -= len(line)
                    self._out = memoryview(line)
                self._out = self._out[self._line.send(self._out) :]


def _message(topic: str, row: bytes) -> bytes:
    body = topic.encode() + b"\0" + row
    return len(body).to_bytes(_HEAD, "little") + body
