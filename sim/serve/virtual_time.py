"""A simulated line for a client in another process, in virtual time."""

import json
import select
import socket
from collections.abc import Callable, Sequence

from snakewalk.config.archive import parse_json
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.served_line import SCHEME
from snakewalk.sim.line.wire import Wire

_IDLE_S = 0.02
"""Longest time between two looks at the end of serving (ours)."""
_CHUNK_BYTES = 4096
_CALLS = ("openPort", "read_until", "getBytesAvailable", "setBaudRate")
"""Methods of the line whose arguments are numbers."""
Due = Callable[[float], Sequence[tuple[float, bytes]]]
"""Returns time and bytes of the datagrams that are due at a time of the line."""


class VirtualTimeServer:
    """Serves ``line`` to one client at a time; its time passes only while the client waits.

    A request is a JSON line ``[method, argument, ...]`` of a ``BytePort`` or its clock. The reply
    has the line's time, the result, a fault or null, and the datagrams that are due.
    """

    missed_s = latest_s = 0.0
    output_flushes = 0

    def __init__(self, line: Wire, due: Due | None) -> None:
        self._line = line
        self._due = due
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._client: socket.socket | None = None
        self._unread = b""
        host, port = self._listener.getsockname()
        self.path = f"{SCHEME}://{host}:{port}"
        """URL of the line, a ``--port``."""

    def __enter__(self) -> "VirtualTimeServer":
        return self

    def __exit__(self, *raised: object) -> None:
        self._listener.close()
        self._drop()

    def serve(self, stopped: Callable[[], bool]) -> None:
        """Serve until ``stopped()``, called at least every 20 ms."""
        while not stopped():
            self.step(_IDLE_S)

    def step(self, wait_s: float) -> None:
        """Wait up to ``wait_s`` (real time) for a client or a request; reply to it."""
        client = self._client
        sockets = [self._listener] if client is None else [self._listener, client]
        ready = select.select(sockets, [], [], wait_s)[0]
        if client is not None and client in ready:
            try:
                self._answer(client)
            except (OSError, ValueError, TypeError):  # it has gone, or sends something else
                self._drop()
        if self._listener in ready:
            self._accept()

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        if self._client is not None:
            connection.close()
            return
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = connection

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None
        self._unread = b""

    def _answer(self, client: socket.socket) -> None:
        received = client.recv(_CHUNK_BYTES)
        if not received:
            raise ConnectionError
        *requests, self._unread = (self._unread + received).split(b"\n")
        for request in requests:
            client.sendall(json.dumps(self._reply(*parse_json(request))).encode() + b"\n")

    def _reply(self, name: str, *arguments: object) -> list[object]:
        line = self._line
        result = fault = None
        try:
            if name == "sleep_until_s":
                line.clock.sleep_until_s(*arguments)  # type: ignore[arg-type]
            elif name == "write":
                line.write(*map(bytes.fromhex, arguments))  # type: ignore[arg-type]
            elif name in _CALLS:
                result = getattr(line, name)(*arguments)
            line.settle()
        except PortError as error:
            fault = str(error)
        now_s = line.clock.now_s()
        due = [(due_s, data.hex()) for due_s, data in self._due(now_s)] if self._due else []
        return [now_s, result.hex() if isinstance(result, bytes) else result, fault, due]
