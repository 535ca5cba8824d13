"""The byte port on a serial line behind a network: ``socket://HOST:PORT``, ``rfc2217://HOST:PORT``."""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them

from __future__ import annotations

import os
import socket
from contextlib import suppress
from types import TracebackType
from typing import Final

import serial

from snakewalk.drivers.clock import Clock, WallClock
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import DRAIN_LIMIT_S, is_url
from snakewalk.drivers.port.serial_port import SerialPort

NETWORK_LATENCY_S: Final = 0.1
"""How late a reply may be besides its wire time: a local network and its server (ours)."""
_POLL_S: Final = 0.001
"""How long a read waits at a time. It stays the same while the port is open: a server of RFC 2217
would be asked to set up its line anew whenever it changed."""
_PIECE_BYTES: Final = 256
"""How much is thrown away at a time."""
_FIXED: Final = ("socket://",)
"""URLs that carry no baud rate: that of the far end stays what it is."""


def open_port(device: str, baud: int = 1_000_000) -> SerialPort | NetworkPort:
    """Open a serial device, or a line behind a network where ``device`` is a URL.

    Raises:
        PortError: it is not there, or cannot be opened.

    """
    return NetworkPort(device, baud) if is_url(device) else SerialPort(device, baud)


class NetworkPort:
    """A line that pyserial's URL handlers reach; implements ``BytePort``.

    Raises:
        PortError: (when opened) nobody listens, an unknown kind of URL; (later) the line is gone.

    """

    def __init__(self, url: str, baud: int = 1_000_000, clock: Clock | None = None) -> None:
        self.is_using = False
        self._url, self._baud = url, baud
        self._clock: Clock = clock if clock is not None else WallClock()
        self._timeout_at_s = 0.0
        self._serial: serial.Serial | None = None
        self.openPort()

    def __enter__(self) -> NetworkPort:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.closePort()

    @property
    def clock(self) -> Clock:
        """Wall time."""
        return self._clock

    @property
    def name(self) -> str:
        """The URL."""
        return self._url

    @property
    def latency_s(self) -> float:
        """How long bytes may be held back on the way, the ``latency_s`` of ``DynamixelBus``."""
        return NETWORK_LATENCY_S

    @property
    def latency_timer_ms(self) -> int | None:
        """None: the adapter is another computer's, and does not say."""
        return None

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        try:
            self._line.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._lost(error) from error

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``deadline_s``."""
        got, line = b"", self._line
        try:
            while len(got) < count and (line.in_waiting or self._clock.now_s() < deadline_s):
                got += line.read(count - len(got))
        except (serial.SerialException, OSError) as error:
            raise self._lost(error) from error
        return got

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Throw bytes away until none has come for ``quiet_s``, for a limited time."""
        drained = 0
        quiet_at_s = self._clock.now_s() + quiet_s
        limit_s = quiet_at_s + DRAIN_LIMIT_S
        while self._clock.now_s() < quiet_at_s:
            got = self.read_until(1, quiet_at_s)
            if got:
                drained += len(got) + len(self.read_until(_PIECE_BYTES, self._clock.now_s()))
                quiet_at_s = min(self._clock.now_s() + quiet_s, limit_s)
        return drained

    # what the SDK calls

    def openPort(self) -> bool:
        if self._serial is not None:
            return True
        try:
            self._serial = serial.serial_for_url(self._url, self._baud, timeout=_POLL_S)
        except (ValueError, serial.SerialException, OSError) as error:
            raise PortError(f"{self._url}: cannot be opened: {error}") from error
        # two small packets in a row must not wait for the first one's acknowledgement
        with (
            suppress(AttributeError, OSError, ValueError, serial.SerialException),
            socket.socket(fileno=os.dup(self._serial.fileno())) as line,
        ):
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def closePort(self) -> None:
        if self._serial is not None:
            line, self._serial = self._serial, None
            with suppress(serial.SerialException, OSError):
                line.close()
        self.is_using = False

    def clearPort(self) -> None:
        limit_s = self._clock.now_s() + DRAIN_LIMIT_S
        while self.getBytesAvailable() and self._clock.now_s() < limit_s:
            self.read_until(_PIECE_BYTES, self._clock.now_s())

    def setBaudRate(self, baudrate: int) -> bool:
        if self._url.startswith(_FIXED):
            return baudrate == self._baud
        try:
            self._line.baudrate = baudrate
        except (ValueError, serial.SerialException, OSError):
            return False
        self._baud = baudrate
        return True

    def getBaudRate(self) -> int:
        return self._baud

    def getBytesAvailable(self) -> int:
        try:
            return int(self._line.in_waiting)
        except (serial.SerialException, OSError) as error:
            raise self._lost(error) from error

    def readPort(self, length: int) -> bytes:
        """Up to ``length`` bytes; waits for the first one, so that the SDK does not spin."""
        first = self.read_until(1, min(self._timeout_at_s, self._clock.now_s() + 0.01))
        return first + self.read_until(length - len(first), self._clock.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        self.write(bytes(packet))
        return len(packet)

    def setPacketTimeout(self, packet_length: int) -> None:
        self.setPacketTimeoutMillis(packet_length * 10_000.0 / self._baud + 2e3 * self.latency_s)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._timeout_at_s = self._clock.now_s() + msec / 1000.0

    def isPacketTimeout(self) -> bool:
        return self._clock.now_s() >= self._timeout_at_s

    @property
    def _line(self) -> serial.Serial:
        if self._serial is None:
            raise PortError(f"{self._url}: is closed")
        return self._serial

    def _lost(self, error: Exception) -> PortError:
        self.is_using = False
        return PortError(f"{self._url}: the line is gone: {error}")
