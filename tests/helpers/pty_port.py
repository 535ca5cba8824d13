"""The servos' pseudo-terminal and our serial port on it: one thread, simulated time."""

from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve.pty import IDLE_S, PtyServer

HAND_OVER_S = 1e-3
"""Real time that the operating system is given to hand bytes over, at each look."""
LOOK_S = 2.5e-4
"""Simulated time between two looks."""


class ServedClock(SimClock):
    """Simulated time at the host, in which the server runs whenever the host waits."""

    server: PtyServer | None = None

    def sleep_until_s(self, time_s: float) -> None:
        """Let the server look as often as it does while idle."""
        while self.now_s() < time_s:
            self.advance(min(IDLE_S, time_s - self.now_s()))
            if self.server is not None:
                self.server.step(0.0)


class PtyPort(SerialPort):
    """A serial port at ``server``; only waiting for bytes differs: it lets the server run."""

    def __init__(self, server: PtyServer, baud: int, clock: ServedClock) -> None:
        super().__init__(server.path, baud, clock)
        self.descriptor = None  # compiled code would wait for real time
        self._server, self._served = server, clock
        clock.server = server

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """As ``BytePort`` says."""
        got = b""
        while True:
            self._server.step(HAND_OVER_S)
            got += super().read_until(count - len(got), self._served.now_s())
            left_s = deadline_s - self._served.now_s()
            if len(got) == count or left_s <= 0.0:
                return got
            self._served.advance(min(LOOK_S, left_s))
