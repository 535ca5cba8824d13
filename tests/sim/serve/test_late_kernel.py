"""Bytes of a pseudo-terminal that the kernel hands over late are not late in simulated time."""

import select
from collections.abc import Callable

import pytest

from snakewalk.sim.serve.pty import PtyServer
from tests.helpers.bus import a_line
from tests.helpers.pty_port import PtyPort, ServedClock

PING = bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E")
ANSWER_BYTES = 14


class LateKernel:
    """Bytes of a server that stay in the kernel until its client waits in real time."""

    def __init__(self, server: PtyServer) -> None:
        self._held: list[bytes] = []
        self._send: Callable[[bytes], None] = server._send
        self._readable = select.poll()
        server._send = self._held.append  # type: ignore[method-assign]

    def stand_before(self, port: PtyPort) -> None:
        """Answer for the terminal of ``port`` whether bytes are there."""
        self._readable.register(port._fileno, select.POLLIN)
        port._readable = self  # type: ignore[assignment]

    def poll(self, wait_ms: float) -> list[tuple[int, int]]:
        """Do as ``select.poll``, and hand over what is held if the client waits."""
        if wait_ms > 0.0:
            for each in self._held:
                self._send(each)
            self._held.clear()
        return self._readable.poll(wait_ms)


@pytest.mark.parametrize("late", [False, True], ids=["at once", "late"])
@pytest.mark.parametrize("cleared", [False, True], ids=["read", "cleared"])
def test_no_simulated_time_passes_while_the_kernel_has_bytes(late: bool, cleared: bool) -> None:
    clock = ServedClock()
    with PtyServer(a_line(1), clock) as server:
        kernel = LateKernel(server) if late else None
        with PtyPort(server, 1_000_000, clock) as port:
            if kernel is not None:
                kernel.stand_before(port)
            port.write(PING)
            if cleared:
                clock.sleep_until_s(0.02)
                port.clearPort()
                assert port.read_until(1, clock.now_s()) == b""
                return
            assert len(port.read_until(ANSWER_BYTES, 0.02)) == ANSWER_BYTES
            assert clock.now_s() == pytest.approx(0.00025)  # one look: 24 bytes need 0.24 ms
