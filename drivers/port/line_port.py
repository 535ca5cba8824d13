"""Base of the byte ports that pyserial opens: the SDK's calls, and the drain."""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them

from abc import ABC, abstractmethod
from contextlib import suppress
from typing import Any, ClassVar, Self

import serial

from snakewalk.drivers.clock import Clock, WallClock
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import DRAIN_LIMIT_S

_PIECE_BYTES = 256
"""Number of bytes that are read at a time, and thrown away."""
_SDK_WAIT_S = 0.01
"""Longest wait of a read of the SDK for the first byte, so that it does not spin (ours)."""


class LinePort(ABC):
    """Implements ``BytePort`` except for opening, reading and writing the line.

    Raises:
        PortError: (when opened) it cannot be; (later) it is gone.

    """

    line_errors: ClassVar[tuple[type[Exception], ...]] = (serial.SerialException, OSError)
    """Exceptions of a line that is gone."""
    grace_ms: ClassVar[float]
    """Largest delay of a reply besides its wire time, for the SDK's own time-outs."""

    def __init__(self, name: str, baud: int, clock: Clock | None) -> None:
        self.is_using = False
        self._name = name
        self._baud = baud
        self._clock: Clock = clock if clock is not None else WallClock()
        self._timeout_at_s = 0.0
        self._serial: Any = None
        self.openPort()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.closePort()

    @property
    def clock(self) -> Clock:
        """Wall time."""
        return self._clock

    @property
    def name(self) -> str:
        """The device's path, or the URL."""
        return self._name

    @property
    def paced(self) -> bool:
        """Whether bytes need the time of the baud rate."""
        return False

    @property
    @abstractmethod
    def latency_s(self) -> float:
        """Largest delay of bytes, for ``latency_s`` of ``DynamixelBus``."""

    @property
    @abstractmethod
    def latency_timer_ms(self) -> int | None:
        """Largest delay by the USB adapter's driver; None if unknown."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    @abstractmethod
    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``deadline_s``."""

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Discard bytes until none has come for ``quiet_s``, for a limited time."""
        drained = 0
        quiet_at_s = self._clock.now_s() + quiet_s
        limit_s = quiet_at_s + DRAIN_LIMIT_S
        while self._clock.now_s() < quiet_at_s:
            received = self.read_until(1, quiet_at_s)
            if received:
                drained += len(received) + len(self.read_until(_PIECE_BYTES, self._clock.now_s()))
                quiet_at_s = min(self._clock.now_s() + quiet_s, limit_s)
        return drained

    # calls of the SDK

    def openPort(self) -> bool:
        if self._serial is None:
            self._open_line()
        return True

    def closePort(self) -> None:
        if self._serial is not None:
            line = self._serial
            self._serial = None
            with suppress(*self.line_errors):  # a lost line is closed as far as possible
                line.close()
        self.is_using = False

    def clearPort(self) -> None:
        limit_s = self._clock.now_s() + DRAIN_LIMIT_S
        while self.getBytesAvailable() and self._clock.now_s() < limit_s:
            self.read_until(_PIECE_BYTES, self._clock.now_s())

    def setBaudRate(self, baudrate: int) -> bool:
        try:
            self._line.baudrate = baudrate
        except self._refusals:
            return False
        self._baud = baudrate
        return True

    def getBaudRate(self) -> int:
        return self._baud

    def getBytesAvailable(self) -> int:
        try:
            return int(self._line.in_waiting)
        except self.line_errors as error:
            raise self._lost(error) from error

    def readPort(self, length: int) -> bytes:
        """Up to ``length`` bytes; waits for the first one, so that the SDK does not spin."""
        first = self.read_until(1, min(self._timeout_at_s, self._clock.now_s() + _SDK_WAIT_S))
        return first + self.read_until(length - len(first), self._clock.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        self.write(bytes(packet))
        return len(packet)

    def setPacketTimeout(self, packet_length: int) -> None:
        self.setPacketTimeoutMillis(packet_length * 10_000.0 / self._baud + self.grace_ms)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._timeout_at_s = self._clock.now_s() + msec / 1000.0

    def isPacketTimeout(self) -> bool:
        return self._clock.now_s() >= self._timeout_at_s

    @abstractmethod
    def _open_line(self) -> None:
        """Set ``_serial``."""

    @property
    def _refusals(self) -> tuple[type[Exception], ...]:
        return (ValueError, *self.line_errors)

    @property
    def _line(self) -> Any:
        if self._serial is None:
            raise PortError(f"{self._name}: is closed")
        return self._serial

    def _lost(self, error: Exception) -> PortError:
        self.is_using = False
        return PortError(f"{self._name}: the port is gone: {error}")
