"""Servos with canned answers behind a pseudo-terminal that keeps the pace of a wire.

``python -m benchmarks.paced_pty BAUD TIMES`` prints the device and answers sync reads and fast sync
reads until its standard input closes; TIMES is a file that ``WireTimes`` has made. A packet is on
the wire from the moment at which the measured program's ``write`` had returned. Answers come as a
USB adapter hands them over: in full packets of 62 bytes as they fill, and the rest when the last
byte has arrived. It spins, so that its own lateness is that of a loop (noted with each answer), and
needs a core of its own: the last one it may use.
"""

import os
import select
import sys
import time
import tty
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from benchmarks.wire_times import Answer, WireTimes
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import HEADER, STATUS, Instruction, fast_head

USB_BYTES = 62
_SPINS_TO_CLOSE = 4096
_PATIENCE_NS = 1_000_000_000
"""A program that is interrupted within its ``write`` notes the time of it late."""
_VALUES = bytes(range(10, 138))


@dataclass(frozen=True, slots=True)
class Part:
    """Some bytes of an answer."""

    due_ns: float
    data: bytes
    asked_ns: int
    heard_ns: int
    last: bool


class PacedServos:
    """What has come, what is due, and how far the line is taken."""

    def __init__(self, master: int, baud: int, times: WireTimes, *, stamped: bool) -> None:
        self._master, self._times, self._stamped = master, times, stamped
        self._byte_ns = 10e9 / baud
        self._answers: dict[bytes, bytes] = {}
        self._pending = b""
        self._heard = self._known = self._known_total = 0
        self._free_ns = 0.0
        self._due: deque[Part] = deque()

    def step(self) -> None:
        """Give what is due, hear what has come."""
        while self._due and self._due[0].due_ns <= time.monotonic_ns():
            part = self._due.popleft()
            given_ns = time.monotonic_ns()
            os.write(self._master, part.data)
            if part.last:
                answer = Answer(part.asked_ns, part.heard_ns, int(part.due_ns), given_ns)
                self._times.add_answer(answer)
        try:
            heard = os.read(self._master, 4096)
        except BlockingIOError:
            return
        self._take(heard, time.monotonic_ns())

    def _take(self, heard: bytes, now_ns: int) -> None:
        self._pending += heard
        self._heard += len(heard)
        asked_ns = self._sent(len(heard), now_ns)
        while len(self._pending) >= 7:
            end = 7 + int.from_bytes(self._pending[5:7], "little")
            if len(self._pending) < end:
                return
            request, self._pending = self._pending[:end], self._pending[end:]
            answer = self._answers.get(request)
            if answer is None:
                answer = self._answers[request] = compose(request)
            for at in range(0, len(answer), USB_BYTES):
                data = answer[at : at + USB_BYTES]
                self._free_ns += len(data) * self._byte_ns
                last = at + USB_BYTES >= len(answer)
                self._due.append(Part(self._free_ns, data, asked_ns, now_ns, last))
        if self._stamped and not self._pending and self._heard < self._known_total:
            self._heard = self._known_total  # a program has thrown away what it wrote
            self._times.add_lost()

    def _sent(self, count: int, now_ns: int) -> int:
        """Let what has come take the line from the time at which it was written; that time."""
        times, asked_ns = self._times, now_ns
        if not self._stamped:
            self._free_ns = max(self._free_ns, now_ns) + count * self._byte_ns
            return asked_ns
        while self._known_total < self._heard:
            if self._known < times.write_count:
                _, asked_ns, total = times.write(self._known)
                taken = total - self._known_total
                self._free_ns = max(self._free_ns, asked_ns) + taken * self._byte_ns
                self._known, self._known_total = self._known + 1, total
            elif time.monotonic_ns() > now_ns + _PATIENCE_NS:
                raise RuntimeError("a program that does not note its times writes here")
        return asked_ns


def main() -> None:
    """Serve."""
    baud, times = int(sys.argv[1]), WireTimes(Path(sys.argv[2]))
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    servos = PacedServos(master, baud, times, stamped="--as-heard" not in sys.argv)
    print(os.ttyname(slave), flush=True)
    spins = 0
    while spins % _SPINS_TO_CLOSE or not select.select([sys.stdin], [], [], 0.0)[0]:
        spins += 1
        servos.step()


def compose(request: bytes) -> bytes:
    """Answer of all servos to a (fast) sync read; nothing to anything else."""
    length, ids = int.from_bytes(request[10:12], "little"), request[12:-2]
    values = _VALUES[:length]
    if request[7] == Instruction.SYNC_READ:
        answer = b""
        for servo in ids:
            head = HEADER + bytes([servo]) + (length + 4).to_bytes(2, "little")
            status = head + bytes([STATUS, 0]) + values
            answer += status + crc16(status).to_bytes(2, "little")
        return answer
    if request[7] == Instruction.FAST_SYNC_READ:
        answer = fast_head(len(ids) * (length + 4))
        for servo in ids:
            answer += bytes([0, servo]) + values
            answer += crc16(answer).to_bytes(2, "little")
        return answer
    return b""


if __name__ == "__main__":
    main()
