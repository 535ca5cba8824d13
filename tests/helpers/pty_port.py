"""The servos' pseudo-terminals and our serial ports on them: one thread, simulated time."""

from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve.pty import IDLE_S, PtyServer

HAND_OVER_S = 1e-3
"""Real time that the operating system is given to hand bytes over, at each look."""
LOOK_S = 2.5e-4
"""Simulated time between two looks."""


class ServedClock(SimClock):
    """Simulated time at the host, in which the servers run whenever the host waits."""

    def __init__(self) -> None:
        super().__init__()
        self.servers: list[PtyServer] = []

    def look(self, wait_s: float) -> None:
        """Let all servers look once; the first waits for so much real time."""
        for server in self.servers:
            server.step(wait_s)
            wait_s = 0.0

    def sleep_until_s(self, time_s: float) -> None:
        """Let the server look as often as it does while idle, first at what has been sent."""
        if self.now_s() < time_s:
            self.look(HAND_OVER_S)
        while self.now_s() < time_s:
            self.advance(min(IDLE_S, time_s - self.now_s()))
            self.look(0.0)


class PtyPort(SerialPort):
    """A serial port at ``server``; only waiting for bytes differs: it lets the server run."""

    def __init__(self, server: PtyServer, baud: int, clock: ServedClock) -> None:
        super().__init__(server.path, baud, clock)
        self.descriptor = None  # compiled code would wait for real time
        self._served = clock
        if server not in clock.servers:
            clock.servers.append(server)

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """As ``BytePort`` says."""
        got = b""
        while True:
            self._served.look(HAND_OVER_S)
            got += super().read_until(count - len(got), self._served.now_s())
            left_s = deadline_s - self._served.now_s()
            if len(got) == count or left_s <= 0.0:
                return got
            self._served.advance(min(LOOK_S, left_s))
