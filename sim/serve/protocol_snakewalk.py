"""pyserial's URL ``snakewalk://...``: a simulated bus of a test, in simulated time.

pyserial imports a URL's handler by this module's name. Reading waits on the line's clock, so it
never sleeps.
"""

from typing import TYPE_CHECKING

import serial
from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.served_line import ServedLine

if TYPE_CHECKING:
    from typing_extensions import Buffer

LINES: dict[str, BytePort] = {}
"""Lines by their URL."""
_ENDLESS_S = 10.0
"""Simulated time after which a read without a time-out counts as endless (ours)."""
_POLL_S = 1e-4
"""Simulated time of asking for the number of bytes, so that a loop of questions ends (ours)."""

if __package__ not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append(__package__)


class Serial(SerialBase):
    """A pyserial port on a simulated line."""

    def open(self) -> None:
        """Open the line of the URL.

        Raises:
            SerialException: no bus has this URL, or its port has vanished.

        """
        url = str(self.port)
        try:
            line = LINES.get(url) or ServedLine(url, self.baudrate)
        except PortError as error:
            raise SerialException(
                f"{url}: no bus has this URL; open bus.url during its test; {error}"
            ) from error
        if not line.openPort():
            raise SerialException(f"{self.port}: the port has vanished")
        self._line = line
        self.is_open = True
        self._reconfigure_port()

    def close(self) -> None:
        """Close the port; a bus of this process stays."""
        if self.is_open and self.port not in LINES:
            self._line.closePort()
        self.is_open = False

    @property
    def in_waiting(self) -> int:
        """Number of bytes that have arrived; the clock advances by 0.1 ms."""
        line = self._opened()
        line.clock.sleep_until_s(line.clock.now_s() + _POLL_S)
        return line.getBytesAvailable()

    def read(self, size: int = 1) -> bytes:
        """Up to ``size`` bytes, until the time-out has passed in simulated time.

        Raises:
            SerialException: the port is gone, or has no time-out and no servo sends the bytes.

        """
        line = self._opened()
        wait_s = _ENDLESS_S if self.timeout is None else self.timeout
        try:
            data = line.read_until(size, line.clock.now_s() + wait_s)
        except PortError as error:
            raise SerialException(str(error)) from error
        if self.timeout is None and len(data) < size:
            raise SerialException(
                f"{self.port}: waits without end for {size} bytes, {len(data)} came; set timeout="
            )
        return data

    def write(self, b: "Buffer", /) -> int:
        """Send bytes; return their number.

        Raises:
            SerialException: the port is gone.

        """
        try:
            return self._opened().writePort(bytes(b))
        except PortError as error:
            raise SerialException(str(error)) from error

    def reset_input_buffer(self) -> None:
        """Drop arrived bytes."""
        self._opened().clearPort()

    def reset_output_buffer(self) -> None:
        """Nothing: written bytes are on the wire."""

    def _opened(self) -> BytePort:
        if not self.is_open:
            raise PortNotOpenError
        return self._line

    def _reconfigure_port(self) -> None:
        self._line.setBaudRate(self.baudrate)

    def _update_dtr_state(self) -> None:
        """Nothing: the line has two wires."""

    _update_rts_state = _update_break_state = _update_dtr_state
