"""The same servos behind a pseudo-terminal, in real time: a serial port for any client.

The clock handed in is real time; it is mirrored on the line's simulated clock whenever the server
looks. What a client writes to ``path`` goes onto the line, and answers are handed out when their
bytes have arrived. A pseudo-terminal has no baud rate: the line keeps its own, whatever is set.
"""

import os
import select
import tty
from collections.abc import Callable
from types import TracebackType

from drivers.clock import Clock
from sim.bus.line import SimLine

IDLE_S = 0.02
"""How often physics catches up while no client talks."""
CHUNK_BYTES = 4096


class PtyServer:
    """Serves ``line`` at ``path`` from construction until ``close``; use it in a ``with``."""

    def __init__(self, line: SimLine, clock: Clock) -> None:
        self._line = line
        self._clock = clock
        self._offset_s = line.clock.now_s() - clock.now_s()
        self._master, self._slave = os.openpty()
        tty.setraw(
            self._slave
        )  # no echo, no line editing; held open so that clients may come and go
        os.set_blocking(self._master, False)
        self.overrun_bytes = 0
        """Bytes lost because the client did not read them."""
        self.path = os.ttyname(self._slave)
        """The device to open as a serial port."""

    def __enter__(self) -> "PtyServer":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Take the device away; safe to call twice."""
        for end in (self._master, self._slave):
            if end >= 0:
                os.close(end)
        self._master = self._slave = -1

    def serve(self, stopped: Callable[[], bool]) -> None:
        """Serve until ``stopped()``, which is asked at least every ``IDLE_S``."""
        while not stopped():
            self.step(IDLE_S)

    def step(self, wait_s: float) -> None:
        """Wait up to ``wait_s`` for a client or an answer, and hand on what is due."""
        due_s = self._line.next_event_s()
        if due_s is not None:
            wait_s = min(wait_s, max(0.0, due_s - self._now_s()))
        ready, _, _ = select.select([self._master], [], [], wait_s)
        line = self._line
        line.clock.sleep_until_s(self._now_s())
        if ready:
            line.write(os.read(self._master, CHUNK_BYTES))
        line.settle()
        arrived = line.read_until(CHUNK_BYTES, line.clock.now_s())
        if arrived:
            try:
                os.write(self._master, arrived)
            except BlockingIOError:  # nobody reads: a UART's buffer would overrun, too
                self.overrun_bytes += len(arrived)

    def _now_s(self) -> float:
        return self._clock.now_s() + self._offset_s
