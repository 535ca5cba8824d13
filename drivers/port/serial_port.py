"""The byte port on a serial device."""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them

from __future__ import annotations

import errno
import os
import select
from contextlib import suppress

import serial
from serial.tools import list_ports

from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import PortBusyError, PortError
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.port.port_holders import holders_of

try:
    import fcntl
    import termios
except ImportError:  # Windows
    fcntl = termios = None  # type: ignore[assignment]

_LATENCY_MS = 16.0
"""Time for which an FTDI adapter holds bytes back by default (its ``latency_timer``)."""
_PROGRAM_S = 0.02
"""Largest delay of a program at the other end of a pseudo-terminal: it has to be scheduled."""
_STUCK_S = 1.0
"""A device that accepts no bytes for this time is gone."""
_BUSY = (errno.EBUSY, errno.EAGAIN)
"""Another program has the device open: it is exclusive, or locked."""


class SerialPort(LinePort):
    """A serial device, opened exclusively; implements ``BytePort``.

    Raises:
        PortError: (when opened) missing, denied, busy, or an impossible baud rate; (later) gone.

    """

    line_errors = (  # termios' error is not an OSError
        *LinePort.line_errors,
        *(() if termios is None else (termios.error,)),
    )
    grace_ms = 2.0 * _LATENCY_MS + 2.0

    def __init__(self, device: str, baud: int = 1_000_000, clock: Clock | None = None) -> None:
        if termios is None:
            raise PortError(
                f"{device}: serial devices are for Linux and macOS; on this system give the URL of "
                "a server that has one: socket://HOST:PORT or rfc2217://HOST:PORT"
            )
        self._readable, self._writable = select.poll(), select.poll()
        self.descriptor: int | None = None
        """File descriptor while the port is open, for compiled code."""
        super().__init__(device, baud, clock)

    @property
    def latency_timer_ms(self) -> int | None:
        """Largest delay by the USB adapter's driver; None if unknown."""
        tty = os.path.basename(os.path.realpath(self._name))
        try:
            with open(f"/sys/bus/usb-serial/devices/{tty}/latency_timer", encoding="ascii") as file:
                return int(file.read())
        except (OSError, ValueError):
            return None  # not a USB adapter, or one without the setting

    @property
    def latency_s(self) -> float:
        """Largest delay of bytes on the host, for ``latency_s`` of ``DynamixelBus``."""
        if self._is_pseudo_terminal():
            return _PROGRAM_S
        timer_ms = self.latency_timer_ms
        return 0.003 + (timer_ms if timer_ms is not None else 1) * 1e-3

    @property
    def paced(self) -> bool:
        """True for a device; a pseudo-terminal has no wire."""
        return not self._is_pseudo_terminal()

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        fd = self._fileno
        try:
            sent = 0
            while True:
                # a device that polls as writable may accept nothing when it is full
                with suppress(BlockingIOError):
                    sent += os.write(fd, data[sent:])
                if sent == len(data):
                    return
                if not self._writable.poll(_STUCK_S * 1e3):
                    raise PortError(f"{self._name}: accepts no more bytes; check adapter and cable")
        except OSError as error:
            raise self._lost(error) from error

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Wait for ``count`` bytes, at most until ``deadline_s``."""
        fd = self._fileno
        received = b""
        try:
            while len(received) < count:
                remaining_s = max(0.0, deadline_s - self._clock.now_s())
                if not self._readable.poll(remaining_s * 1e3):
                    break
                try:
                    more = os.read(fd, count - len(received))
                except BlockingIOError:
                    continue  # another program reads this port too
                if not more:
                    raise OSError(errno.EIO, "ready to be read, but empty")
                received += more
        except OSError as error:
            raise self._lost(error) from error
        return received

    # calls of the SDK

    def closePort(self) -> None:
        self.descriptor = None
        if self._serial is not None:
            with suppress(*self.line_errors):
                fcntl.ioctl(self._serial.fileno(), termios.TIOCNXCL)
        super().closePort()

    def clearPort(self) -> None:
        try:
            self._line.reset_input_buffer()
        except self.line_errors as error:
            raise self._lost(error) from error

    @property
    def _fileno(self) -> int:
        return int(self._line.fileno())

    def _open_line(self) -> None:
        try:
            self._serial = serial.Serial(self._name, self._baud, timeout=0.0, exclusive=True)
            self._serial.reset_input_buffer()
        except self._refusals as error:
            raise self._open_error(error) from error
        self.descriptor = int(self._serial.fileno())
        # Programs that request no lock could open a locked device. Not on a pseudo-terminal: its
        # other end keeps the flag after this program is killed.
        if not self._is_pseudo_terminal():
            with suppress(*self.line_errors):
                fcntl.ioctl(self.descriptor, termios.TIOCEXCL)
        self._readable, self._writable = select.poll(), select.poll()
        self._readable.register(self._serial.fileno(), select.POLLIN)
        self._writable.register(self._serial.fileno(), select.POLLOUT)
        # sets the latency timer of an FTDI driver to 1 ms instead of 16; others have none
        with suppress(ValueError, NotImplementedError, *self.line_errors):
            self._serial.set_low_latency_mode(True)

    def _is_pseudo_terminal(self) -> bool:
        return os.path.realpath(self._name).startswith("/dev/pts/")

    def _open_error(self, error: Exception) -> PortError:
        kind = PortBusyError if getattr(error, "errno", None) in _BUSY else PortError
        return kind(open_fault(self._name, self._baud, error))


def open_fault(name: str, baud: int, error: Exception) -> str:
    """Reason why a device could not be opened, and the remedy."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        there = ", ".join(sorted(port.device for port in list_ports.comports()))
        return f"{name}: no such port; there is {there or 'none: is it plugged in?'}"
    if number in (errno.EACCES, errno.EPERM):
        return f"{name}: no permission; join the group that owns it (often 'dialout')"
    if number in _BUSY:
        holders = holders_of(name)
        is_own = any(holder.is_snakewalk for holder in holders)
        remedy = f"end it, a run by: snakewalk stop --port {name}" if is_own else "close it"
        text = ", ".join(map(str, holders))
        return f"{name}: another program has it open{text and ': '}{text}; {remedy}"
    if isinstance(error, ValueError):
        return f"{name}: {baud} bit/s is not possible here: {error}"
    if _is_no_terminal(name):
        return f"{name}: is not a serial device; name one such as /dev/ttyUSB0"
    return f"{name}: cannot be opened: {error}"


def _is_no_terminal(device: str) -> bool:
    """Whether this is a file, a folder or a device without a baud rate."""
    with suppress(OSError):
        descriptor = os.open(device, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            return not os.isatty(descriptor)
        finally:
            os.close(descriptor)
    return False
