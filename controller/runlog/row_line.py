"""The line between a run and a watcher, its page for one: rows of the log one way, requests back.

The run never waits: what does not fit the socket stays here, of each kind of measurement only the
newest row, and it is sent when the watcher asks for it. A watcher that is slow, stopped or dead is
simply not sent anything. A request is a line of text: an empty one asks for the newest rows, any
other is a command of whoever holds the page, such as ``frequency_hz=0.4``, or of a ROS graph.
"""

import json
import socket
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final

KEPT: Final = frozenset({"/config", "/path", "/waypoints", "/event", "/button", "/gait", "/course"})
"""Topics of which every row is sent, in order; of others the newest."""
SENT: Final = KEPT | {"/cycle", "/shadow", "/pose", "/slow", "/imu", "/picture"}
_KEPT_MAX: Final = 1000
_COMMANDS_MAX: Final = 100
"""Commands that wait for the run; of more the oldest are dropped."""
_LINE_BYTES: Final = 1 << 20
_RECEIVE_BYTES: Final = 1 << 18
_HEAD: Final = 4
_END: Final = b"\n"


class RunEnd:
    """The run's end of the line."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        line.setblocking(False)
        self._kept: deque[bytes] = deque(maxlen=_KEPT_MAX)
        self._newest: dict[str, bytes] = {}
        self._out = memoryview(b"")
        self._ready = False
        self._in = b""
        self._commands: deque[str] = deque(maxlen=_COMMANDS_MAX)

    def add(self, topic: str, row: bytes) -> None:
        """Take a row; a cycle is complete with its pose."""
        if topic not in SENT:
            return
        if topic in KEPT:
            self._kept.append(_message(topic, row))
        else:
            self._newest[topic] = row
        if topic in KEPT or topic == "/pose":
            self.pump()

    def pump(self) -> None:
        """Send what the watcher can take now; never waits."""
        try:
            self._receive()
            while self._next():
                self._out = self._out[self._line.send(self._out) :]
        except BlockingIOError:
            return
        except OSError:  # the watcher is gone: the run goes on
            self._kept.clear()
            self._newest.clear()
            self._out = memoryview(b"")

    def commands(self) -> list[str]:
        """Commands that have come since the last call; never waits."""
        with suppress(OSError):
            self._receive()
        taken = list(self._commands)
        self._commands.clear()
        return taken

    def close(self, patience_s: float) -> None:
        """Send the last rows, for no longer than ``patience_s`` to a slow watcher; then close."""
        self._ready = True
        self._line.settimeout(patience_s)
        while self._next():
            try:
                self._out = self._out[self._line.send(self._out) :]
            except OSError:
                break
        self._line.close()

    def _next(self) -> bool:
        """Whether there is anything to send."""
        if len(self._out):
            return True
        if self._kept:
            self._out = memoryview(self._kept.popleft())
        elif self._ready and self._newest:
            rows = sorted(self._newest.items(), key=lambda row: row[0] == "/pose")
            self._out = memoryview(b"".join(_message(topic, row) for topic, row in rows))
            self._newest = {}
            self._ready = False
        return len(self._out) > 0

    def _receive(self) -> None:
        with suppress(BlockingIOError):
            *lines, self._in = (self._in + self._line.recv(_RECEIVE_BYTES)).split(_END)
            self._in = self._in[-_LINE_BYTES:]
            for line in lines:
                if line:
                    self._commands.append(line.decode(errors="replace"))
                else:
                    self._ready = True


class WatcherEnd:
    """The watcher's end of the line."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._in = bytearray()

    def ask(self) -> None:
        """Ask for the newest rows."""
        self._line.sendall(_END)

    def command(self, text: str) -> None:
        """Send a command, of one line."""
        self._line.sendall(text.replace("\n", " ").encode() + _END)

    def rows(self, wait_s: float) -> Iterator[tuple[str, dict[str, Any]]]:
        """Topics and rows that have come, waiting at most ``wait_s`` for the first.

        Raises:
            EOFError: the run has closed the line.

        """
        self._line.settimeout(wait_s)
        try:
            data = self._line.recv(1 << 18)
        except (TimeoutError, BlockingIOError):
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


def _message(topic: str, row: bytes) -> bytes:
    body = topic.encode() + b"\0" + row
    return len(body).to_bytes(_HEAD, "little") + body
