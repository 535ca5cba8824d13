"""The servos' pseudo-terminals and our serial ports on them: one thread, simulated time.

The kernel hands the bytes of a pseudo-terminal over in a thread of its own, later on a busy
machine. Simulated time stops until it has, in both directions: no result depends on the machine.
"""

from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve.pty import IDLE_S, PtyServer

HAND_OVER_S = 1e-3
"""Real time between two looks for bytes that the kernel has not handed over."""
LOOK_S = 2.5e-4
"""Simulated time between two looks."""
_TRIES = 300
"""Looks for bytes that were sent: a busy machine hands them over late, a flush never."""


class ServedClock(SimClock):
    """Simulated time at the host, in which the servers run whenever the host waits."""

    def __init__(self) -> None:
        super().__init__()
        self.servers: list[PtyServer] = []
        self.arriving: dict[PtyServer, int] = {}
        """Bytes that a server has sent and its client has not read."""
        self._outstanding = 0

    def serve(self, server: PtyServer) -> None:
        """Let a server run, too, and count what it receives and sends."""
        self.arriving[server] = 0
        if server in self.servers:
            return
        self.servers.append(server)
        receive, send = server._receive, server._send

        def counted() -> bytes:
            received = receive()
            self._outstanding -= len(received)
            return received

        def counting(arrived: bytes) -> None:
            overrun = server.overrun_bytes
            send(arrived)
            self.arriving[server] += len(arrived) - (server.overrun_bytes - overrun)

        server._receive = counted  # type: ignore[method-assign]
        server._send = counting  # type: ignore[method-assign]

    def on_sent(self, count: int) -> None:
        """Expect as many bytes at the servers."""
        self._outstanding = max(self._outstanding, 0) + count

    def deliver(self) -> None:
        """Wait, in real time, until the servers have what was sent; simulated time stops."""
        for _ in range(_TRIES):
            if self._outstanding <= 0:
                return
            self.look(HAND_OVER_S)
        self._outstanding = 0

    def look(self, wait_s: float) -> None:
        """Let all servers look once; the first waits for so much real time."""
        for server in self.servers:
            server.step(wait_s)
            wait_s = 0.0

    def sleep_until_s(self, time_s: float) -> None:
        """Let the server look as often as it does while idle, first at what has been sent."""
        self.deliver()
        while self.now_s() < time_s:
            self.advance(min(IDLE_S, time_s - self.now_s()))
            self.look(0.0)


class PtyPort(SerialPort):
    """A serial port at ``server``; only waiting for bytes differs: it lets the server run."""

    def __init__(self, server: PtyServer, baud: int, clock: ServedClock) -> None:
        super().__init__(server.path, baud, clock)
        self.descriptor = None  # compiled code would wait for real time
        self._served, self._server = clock, server
        clock.serve(server)

    def write(self, data: bytes) -> None:
        """As ``BytePort`` says."""
        super().write(data)
        self._served.on_sent(len(data))

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """As ``BytePort`` says."""
        got = b""
        while True:
            self._served.deliver()
            self._served.look(0.0)
            got += self._handed_over(count - len(got))
            left_s = deadline_s - self._served.now_s()
            if len(got) == count or left_s <= 0.0:
                return got
            self._served.advance(min(LOOK_S, left_s))

    def clearPort(self) -> None:
        """As ``BytePort`` says; bytes on their way are discarded, too."""
        self._handed_over(self._served.arriving[self._server])
        super().clearPort()

    def _handed_over(self, count: int) -> bytes:
        """Return up to ``count`` bytes of those sent; wait in real time until they are there."""
        arriving = self._served.arriving
        count = min(count, arriving[self._server])
        got = b""
        for _ in range(_TRIES):
            got += super().read_until(count - len(got), self._served.now_s())
            if len(got) == count:
                arriving[self._server] -= count
                return got
            self._readable.poll(HAND_OVER_S * 1e3)
        arriving[self._server] = 0  # another reader, or a flush, has the rest
        return got
