"""The byte port on a serial line behind a network: ``socket://HOST:PORT``, ``rfc2217://HOST:PORT``."""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them

from __future__ import annotations

import os
import socket
from contextlib import suppress
from urllib.parse import urlsplit

import serial

from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import is_url
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.port.served_line import SCHEME, ServedLine

NETWORK_LATENCY_S = 0.1
"""Largest delay of a reply besides its wire time: a local network and its server (ours)."""
_POLL_S = 0.001
"""Time-out of each read; constant, because a server of RFC 2217 would set up its line again."""
_SCHEMES_WITHOUT_BAUD = ("socket",)
"""Schemes that carry no baud rate: the far end keeps its own."""
_TO_A_HOST = ("socket", "rfc2217")


def open_port(device: str, baud: int = 1_000_000, clock: Clock | None = None) -> LinePort:
    """Open a serial device, or the line behind a URL.

    Ports of one chain share a ``clock``; None: its own.

    Raises:
        PortError: it is missing, or cannot be opened.

    """
    if device.startswith(f"{SCHEME}://"):
        if clock is not None:
            raise PortError(f"{device}: has virtual time, which ports of one chain cannot share")
        return ServedLine(device, baud)
    kind = NetworkPort if is_url(device) else SerialPort
    return kind(device, baud, clock)


class NetworkPort(LinePort):
    """A line behind pyserial's URL handlers; implements ``BytePort``.

    Raises:
        PortError: (when opened) no server, or no scheme of ``URL_SCHEMES``; (later) the line is
            gone.

    """

    grace_ms = 2e3 * NETWORK_LATENCY_S

    def __init__(self, url: str, baud: int = 1_000_000, clock: Clock | None = None) -> None:
        super().__init__(url, baud, clock)

    @property
    def latency_s(self) -> float:
        """Largest delay of bytes, for ``latency_s`` of ``DynamixelBus``."""
        return NETWORK_LATENCY_S

    @property
    def latency_timer_ms(self) -> int | None:
        """None: another computer has the adapter."""
        return None

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        try:
            self._line.write(data)
        except self.line_errors as error:
            raise self._lost(error) from error

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``deadline_s``."""
        received = b""
        line = self._line
        try:
            while len(received) < count and (line.in_waiting or self._clock.now_s() < deadline_s):
                received += line.read(count - len(received))
        except self.line_errors as error:
            raise self._lost(error) from error
        return received

    @property
    def _scheme(self) -> str:
        return self._name.partition("://")[0].lower()

    def setBaudRate(self, baudrate: int) -> bool:
        if self._scheme in _SCHEMES_WITHOUT_BAUD:
            return baudrate == self._baud
        return super().setBaudRate(baudrate)

    def _open_line(self) -> None:
        from snakewalk.config.robot.ports import port_fault  # noqa: PLC0415  slow to import

        fault = port_fault(self._name)
        if fault is not None:
            raise PortError(f"{self._name}: {fault}")
        kind = self._scheme
        if kind in _TO_A_HOST and not _names_host_and_port(self._name):
            raise PortError(
                f"{self._name}: cannot be opened: expected {kind}://HOST:PORT, as {kind}://pi:5000"
            )
        try:
            self._serial = serial.serial_for_url(self._name, self._baud, timeout=_POLL_S)
        except self._refusals as error:
            raise PortError(f"{self._name}: cannot be opened: {error}") from error
        # the second of two small packets must not wait for an acknowledgement
        with (
            suppress(AttributeError, ValueError, *self.line_errors),
            socket.socket(fileno=os.dup(self._serial.fileno())) as line,
        ):
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _names_host_and_port(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return bool(parts.hostname and parts.port)
    except ValueError:  # the port is not a number up to 65535
        return False
