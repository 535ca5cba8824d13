"""The byte port: the interface of a serial device, and of a simulated line.

It has the methods that the DYNAMIXEL SDK's packet handlers call (SDK names, milliseconds), and
those of the control cycle (seconds, deadlines).
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
    """True between an instruction and its reply; the handler of an exception clears it."""

    def openPort(self) -> bool:
        """Open (again) at the current baud rate; True on success."""
        ...

    def closePort(self) -> None:
        """Close; safe to call twice."""
        ...

    def clearPort(self) -> None:
        """Throw away what has arrived and was not read."""
        ...

    def setBaudRate(self, baudrate: int) -> bool:
        """Change the speed of the host's side; False if the port cannot."""
        ...

    def getBaudRate(self) -> int:
        """Speed of the host's side, bit/s."""
        ...

    def getBytesAvailable(self) -> int:
        """Bytes that have arrived and were not read."""
        ...

    def readPort(self, length: int) -> bytes:
        """Up to ``length`` bytes that have arrived by now; never waits for more to come.

        The SDK repeats this until ``isPacketTimeout``. On a simulated line, a call that returns
        nothing moves the clock to the next byte, or to the time-out.
        """
        ...

    def writePort(self, packet: bytes | list[int]) -> int:
        """Send; the number of bytes taken."""
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
        """The time that the deadlines below are in; a simulated line owns a simulated one."""
        ...

    @property
    def name(self) -> str:
        """For messages: ``/dev/ttyUSB0``, ``simulated line``."""
        ...

    @property
    def paced(self) -> bool:
        """Whether on the clock bytes need the time of the baud rate.

        False on a pseudo-terminal, and on a network.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of ``data`` without waiting until it is on the wire.

        Consecutive writes go out back to back, in order.
        """
        ...

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``clock.now_s() >= deadline_s``.

        Returns fewer bytes if the deadline has passed; at once with a deadline in the past.
        """
        ...

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Throw bytes away until none has come for ``quiet_s``; the number thrown away.

        Waits at least ``quiet_s``, and at most ``quiet_s + DRAIN_LIMIT_S``.
        """
        ...


@runtime_checkable
class DescriptorPort(Protocol):
    """A byte port whose file descriptor compiled code may write and read directly."""

    descriptor: int | None
    """Non-blocking; None: the port is closed, or only its methods may be used."""

    def getBaudRate(self) -> int:
        """Method of ``SdkPort``."""
        ...

    def write(self, data: bytes) -> None:
        """Method of ``BytePort``."""
        ...


def is_url(device: str) -> bool:
    """Whether a port's name is that of a line behind a network, and no path."""
    return "://" in device


def reopen(port: BytePort) -> None:
    """Close and open again, after the port was gone.

    Raises:
        PortError: it is still not there.

    """
    port.closePort()
    if not port.openPort():
        raise PortError(f"{port.name}: cannot be opened again")
