"""The byte port on a line that another process simulates: ``snakewalk://HOST:PORT``."""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them

import json
import socket
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlsplit

from snakewalk.config.archive import parse_json
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.line_port import LinePort

SCHEME = "snakewalk"
_LATENCY_S = 0.02
"""Largest delay of a reply besides its wire time; a server may simulate an adapter's (ours)."""


class ServedLine(LinePort):
    """A line in virtual time, and its own clock.

    Time passes on the line only while this port waits, so neither process needs to be punctual.
    Each request and each reply is a line of JSON (``sim.serve.virtual_time``).

    Raises:
        PortError: (when opened) no server, or it has another client; (later) it has ended.

    """

    line_errors = (OSError,)
    grace_ms = 2e3 * _LATENCY_S
    latency_s = _LATENCY_S
    latency_timer_ms = None
    paced = True

    def __init__(self, url: str, baud: int = 1_000_000) -> None:
        self._now_s = 0.0
        self._awaited = 0
        self._datagrams: list[tuple[float, bytes]] = []
        super().__init__(url, baud, self)

    def now_s(self) -> float:
        """Seconds of simulated time."""
        return self._now_s

    def sleep_until_s(self, time_s: float) -> None:
        """Let time pass on the line; without a server only this clock moves."""
        if self._serial is None:
            self._now_s = max(self._now_s, time_s)
        else:
            self._call("sleep_until_s", time_s)

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        self._call("write", data.hex())

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``deadline_s``."""
        return bytes.fromhex(self._call("read_until", count, deadline_s))

    def due(self, now_s: float) -> Sequence[tuple[float, bytes]]:
        """Return time and bytes of the datagrams of a tracker since the last call."""
        due = self._datagrams
        self._datagrams = []
        return due

    def getBytesAvailable(self) -> int:
        return int(self._call("getBytesAvailable"))

    def setBaudRate(self, baudrate: int) -> bool:
        self._baud = baudrate
        return bool(self._call("setBaudRate", baudrate))

    def _open_line(self) -> None:
        try:
            address = urlsplit(self._name)
            with socket.create_connection((address.hostname, address.port)) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._serial = connection.makefile("rwb")
            self._awaited = 0
            self._call("sleep_until_s", self._now_s)  # the time while it was closed
            if not self._call("openPort"):
                raise PortError("the port has vanished")
            self.setBaudRate(self._baud)
        except (ValueError, OSError, PortError) as error:
            self.closePort()
            raise PortError(
                f"{self._name}: cannot be opened: {error}; start snakewalk bus serve "
                "--virtual-time, whose line has one client"
            ) from error

    def _call(self, name: str, *arguments: object) -> Any:
        """Call a method of the line in the other process."""
        try:
            line = self._line
            line.write(json.dumps([name, *arguments]).encode() + b"\n")
            self._awaited += 1
            line.flush()
            while self._awaited:  # more than one after a signal has interrupted a call
                reply = line.readline()
                self._awaited -= 1
                if not reply:
                    raise ConnectionError("its server has ended")
                now_s, result, fault, datagrams = parse_json(reply)
                self._now_s = now_s
                self._datagrams += [(due_s, bytes.fromhex(data)) for due_s, data in datagrams]
        except (OSError, ValueError) as error:
            self.closePort()
            raise self._lost(error) from error
        if fault:
            raise PortError(fault)
        return result
