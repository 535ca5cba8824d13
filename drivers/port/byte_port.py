"""The byte port: interface of a serial device and of a simulated line.

It has the methods of the DYNAMIXEL SDK's packet handlers (SDK names, milliseconds), and those of
the control cycle (seconds, deadlines).
"""

# ruff: noqa: N802 - the SDK chose the names

from typing import Protocol, runtime_checkable

from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import PortError

DRAIN_LIMIT_S = 0.1
"""Longest time for which bytes of a line that does not become quiet are discarded (ours)."""


class SdkPort(Protocol):
    """Calls of ``dynamixel_sdk``, with its names and units."""

    is_using: bool
    """Whether an instruction waits for its reply; the handler of an exception clears it."""

    def openPort(self) -> bool:
        """Open (again) at the current baud rate; True on success."""
        ...

    def closePort(self) -> None:
        """Close; safe to call twice."""
        ...

    def clearPort(self) -> None:
        """Discard unread bytes."""
        ...

    def setBaudRate(self, baudrate: int) -> bool:
        """Change the host's baud rate; False if the port cannot."""
        ...

    def getBaudRate(self) -> int:
        """Baud rate of the host, bit/s."""
        ...

    def getBytesAvailable(self) -> int:
        """Number of unread bytes."""
        ...

    def readPort(self, length: int) -> bytes:
        """Up to ``length`` bytes that have arrived; never waits.

        The SDK repeats this until ``isPacketTimeout``. On a simulated line, a call that returns
        nothing moves the clock to the next byte, or to the time-out.
        """
        ...

    def writePort(self, packet: bytes | list[int]) -> int:
        """Send; return the number of bytes accepted."""
        ...

    def setPacketTimeout(self, packet_length: int) -> None:
        """Start the time-out for a reply of ``packet_length`` bytes."""
        ...

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Start a time-out, ms."""
        ...

    def isPacketTimeout(self) -> bool:
        """Whether the time-out has passed."""
        ...


class BytePort(SdkPort, Protocol):
    """A half-duplex line with a clock.

    All methods raise ``PortError`` when the port is gone. A wrong baud rate causes noise or
    silence, never an exception.
    """

    @property
    def clock(self) -> Clock:
        """Clock of the deadlines; a simulated line has a simulated one."""
        ...

    @property
    def name(self) -> str:
        """For messages: ``/dev/ttyUSB0``, ``simulated line``."""
        ...

    @property
    def paced(self) -> bool:
        """Whether bytes need the time of the baud rate on the clock.

        False on a pseudo-terminal, and on a network.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of ``data`` without waiting for the wire; writes go out back to back."""
        ...

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``clock.now_s() >= deadline_s``.

        Returns fewer bytes after the deadline; at once if it is past.
        """
        ...

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Discard bytes until none has come for ``quiet_s``; return their number.

        Waits between ``quiet_s`` and ``quiet_s + DRAIN_LIMIT_S``.
        """
        ...


@runtime_checkable
class DescriptorPort(Protocol):
    """A byte port whose file descriptor compiled code may use directly."""

    descriptor: int | None
    """Non-blocking; None: the port is closed, or only its methods may be used."""

    def getBaudRate(self) -> int:
        """Method of ``SdkPort``."""
        ...

    def write(self, data: bytes) -> None:
        """Method of ``BytePort``."""
        ...


def is_url(device: str) -> bool:
    """Whether a port's name is a URL, not a path."""
    return "://" in device


def reopen(port: BytePort) -> None:
    """Close and open a lost port.

    Raises:
        PortError: it is still missing.

    """
    port.closePort()
    if not port.openPort():
        raise PortError(f"{port.name}: cannot be opened again")
