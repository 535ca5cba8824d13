"""A pseudo-terminal with simulated servos behind it, in real time: a serial port for any client.

The line's clock advances by ``pace`` times real time. Bytes that a client writes to ``path`` go
onto the line; replies return when their bytes have arrived. If the server stalls (a busy machine,
or slow physics), simulated time pauses. After a client sets a baud rate, servos at another rate are
silent.
"""

import fcntl
import logging
import os
import select
import struct
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.protocol.registers import BAUDS
from snakewalk.sim.line.wire import Wire

IDLE_S = 0.02
"""Period with which the physics catches up while no client talks."""
SPIN_S = 1e-3
"""Shorter waits poll: on a busy machine a sleep may end 10 ms late."""
LATE_S = 0.1
"""Real time that one step may make up for; the rest is left out."""
PACE_MAX = 1000.0
"""Largest factor of time (ours): a step then lasts 100 simulated seconds."""
CHUNK_BYTES = 4096
_SPEEDS = {getattr(termios, f"B{baud}"): baud for baud in BAUDS if hasattr(termios, f"B{baud}")}
_OUTPUT_SPEED = 5
"""Index of the output speed in the attributes of a terminal."""


_LINK_CHECK_S = 1.0
"""Time between two looks at the link (ours)."""
_LOGGER = logging.getLogger("snakewalk")


class PtyServer:
    """Serves ``line`` at ``path`` from construction until ``close``; use it in a ``with``.

    ``link`` is a symbolic link that always leads to the device, whose name may change.

    Raises:
        InputError: ``link`` is a file or belongs to a running server; ``pace`` is not positive, or
            over ``PACE_MAX``.

    """

    def __init__(
        self, line: Wire, clock: Clock, *, pace: float = 1.0, link: Path | None = None
    ) -> None:
        self._line = line
        self._clock = clock
        self._pace = _checked_pace(pace)
        self._link = link
        self._offset_s = line.clock.now_s() - clock.now_s() * pace
        self.missed_s = 0.0
        """Time on the line that was left out because the server came late."""
        self.latest_s = 0.0
        """Longest time by which it came late, also if none was left out; ``IDLE_S`` is not late."""
        self._master = self._slave = -1
        self._speed = 0
        self.overrun_bytes = 0
        """Bytes lost because the client did not read them."""
        self.output_flushes = 0
        """Least number of times that the client discarded bytes that the kernel had not handed
        over; all flushes between two looks count as one."""
        self._link_checked_s = clock.now_s()
        self.path = ""
        """Path of the device to open as a serial port; empty while the port has vanished."""
        self._open_pty()

    def __enter__(self) -> "PtyServer":
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the device; safe to call twice."""
        if self.path and select.select([self._master], [], [], 0.0)[0]:
            self._receive()  # count a flush since the last check
        for end in (self._master, self._slave):
            if end >= 0:
                os.close(end)
        self._master = self._slave = -1
        self.path = ""
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()

    def set_pace(self, pace: float) -> None:
        """Change the factor of time on the line.

        Raises:
            InputError: it is not positive.

        """
        self._offset_s += self._clock.now_s() * (self._pace - _checked_pace(pace))
        self._pace = pace

    def real_time_s(self, line_s: float) -> float:
        """Return the server's clock time at a time of the line."""
        return (line_s - self._offset_s) / self._pace

    def serve(self, stopped: Callable[[], bool]) -> None:
        """Serve until ``stopped()``, called at least every ``IDLE_S``."""
        while not stopped():
            self.step(IDLE_S)

    def step(self, wait_s: float) -> None:
        """Wait up to ``wait_s`` (real time) for a client or a reply; pass on due bytes."""
        line = self._line
        if not self.path:
            select.select([], [], [], wait_s)
            self._catch_up()
            if not line.disconnected:
                line.openPort()
                self._open_pty()
            return
        self._check_link()
        ready = self._wait_for_client(wait_s)
        self._catch_up()
        if line.disconnected:
            self.close()
            return
        if ready:
            self._follow_baud_rate()
            received = self._receive()
            if received:
                line.write(received)
            line.settle()
        arrived = line.read_until(CHUNK_BYTES, line.clock.now_s())
        if arrived:
            self._send(arrived)

    def _send(self, arrived: bytes) -> None:
        """Hand bytes to the kernel, which hands them to the client."""
        try:
            os.write(self._master, arrived)
        except BlockingIOError:  # no client reads: a UART's buffer would overrun, too
            self.overrun_bytes += len(arrived)

    def _receive(self) -> bytes:
        """Bytes of the client; empty if the kernel reports another event."""
        received = os.read(self._master, CHUNK_BYTES)
        if received[0] == termios.TIOCPKT_DATA:
            return received[1:]
        self.output_flushes += bool(received[0] & termios.TIOCPKT_FLUSHWRITE)
        return b""

    def _wait_for_client(self, wait_s: float) -> bool:
        """Wait for a client, a line event or ``wait_s``; return whether a client has sent."""
        until_s, due_s = self._clock.now_s() + wait_s, self._line.next_event_s()
        if due_s is not None:
            until_s = min(until_s, (due_s - self._offset_s) / self._pace)
        left_s = until_s - self._clock.now_s()
        nap_s = left_s if left_s > SPIN_S else 0.0
        while not select.select([self._master], [], [], nap_s)[0]:
            before_s, left_s = left_s, until_s - self._clock.now_s()
            if nap_s > 0.0 or left_s <= 0.0:
                return False
            nap_s = left_s if left_s == before_s else 0.0  # a clock that a test moves
        return True

    def _open_pty(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)  # no echo; held open so that clients may come and go
        os.set_blocking(self._master, False)
        fcntl.ioctl(self._master, termios.TIOCPKT, struct.pack("i", 1))  # reports flushes
        self.path = os.ttyname(self._slave)
        self._speed = termios.tcgetattr(self._slave)[_OUTPUT_SPEED]
        if self._link is not None:
            self._make_link(self._link)

    def _make_link(self, link: Path) -> None:
        if link.is_symlink() and (not link.exists() or os.readlink(link) == self.path):
            link.unlink()  # left by a killed server, whose device name may be reused here
        try:
            link.symlink_to(self.path)
        except FileExistsError:
            what = f"leads to {os.readlink(link)}" if link.is_symlink() else "is no link"
            self._link = None  # another server's: do not remove it at the end
            self.close()
            raise InputError(
                f"{link}: is there already, and {what}: end the server whose it is, choose another "
                f"name, or remove it if its server was killed: rm {link}"
            ) from None

    def _check_link(self) -> None:
        """Report once a second that another program deleted or redirected the link.

        A deleted link is restored; a redirected one is left alone.
        """
        link = self._link
        now_s = self._clock.now_s()
        if link is None or now_s - self._link_checked_s < _LINK_CHECK_S:
            return
        self._link_checked_s = now_s
        if link.is_symlink() and os.readlink(link) == self.path:
            return
        try:
            if not link.is_symlink() and not link.exists():
                link.symlink_to(self.path)
                _LOGGER.warning("%s: was deleted; it leads to %s again", link, self.path)
                return
            where = os.readlink(link) if link.is_symlink() else "a file"
            text = f"leads to {where} now"
        except OSError as error:
            text = f"was deleted and cannot be created again: {error.strerror}"
        self._link = None
        _LOGGER.warning("%s: %s; the servos are at %s", link, text, self.path)

    def _follow_baud_rate(self) -> None:
        speed = termios.tcgetattr(self._slave)[_OUTPUT_SPEED]
        if speed != self._speed:
            self._speed = speed
            baud = _SPEEDS.get(speed)
            if baud is not None and baud != self._line.getBaudRate():
                self._line.setBaudRate(baud)

    def _catch_up(self) -> None:
        line = self._line
        since_s = self._now_s() - line.clock.now_s()
        self.latest_s = max(self.latest_s, since_s - IDLE_S * self._pace)
        late_s = since_s - LATE_S * self._pace
        if late_s > 0.0:
            self._offset_s -= late_s
            self.missed_s += late_s
        line.clock.sleep_until_s(self._now_s())
        line.settle()

    def _now_s(self) -> float:
        return self._clock.now_s() * self._pace + self._offset_s


def _checked_pace(pace: float) -> float:
    if not pace > 0.0:
        raise InputError(f"pace {pace:g}: must be above 0; 1 is real time, 0.5 half as fast")
    if pace > PACE_MAX:
        raise InputError(f"pace {pace:g}: must be at most {PACE_MAX:g}; 1 is real time")
    return pace
