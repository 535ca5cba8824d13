"""Servos with canned answers behind a pseudo-terminal that keeps the pace of a wire.

``python -m benchmarks.paced_pty BAUD`` prints the device and answers sync reads and fast sync reads
until its standard input closes. Answers come as a USB adapter hands them over: in full packets of
62 bytes as they fill, and the rest when the last byte has arrived. It spins, so that the host's
process alone is measured; so it needs a core of its own.
"""

import os
import select
import sys
import time
import tty

from drivers.protocol.crc import crc16
from drivers.protocol.packet import HEADER, STATUS, Instruction
from sim.bus.fast_answer import fast_head

USB_BYTES = 62
_SPINS_TO_CLOSE = 4096
_VALUES = bytes(range(10, 138))


def main() -> None:
    """Serve."""
    byte_s = 10.0 / int(sys.argv[1])
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    print(os.ttyname(slave), flush=True)
    answers: dict[bytes, bytes] = {}
    pending = b""
    free_s = 0.0
    due: list[tuple[float, bytes]] = []
    spins = 0
    while True:
        spins += 1
        if spins % _SPINS_TO_CLOSE == 0 and select.select([sys.stdin], [], [], 0.0)[0]:
            return
        now_s = time.perf_counter()
        while due and due[0][0] <= now_s:
            os.write(master, due.pop(0)[1])
        try:
            pending += os.read(master, 4096)
        except BlockingIOError:
            continue
        now_s = time.perf_counter()
        while len(pending) >= 7:
            end = 7 + int.from_bytes(pending[5:7], "little")
            if len(pending) < end:
                break
            request, pending = pending[:end], pending[end:]
            free_s = max(free_s, now_s) + len(request) * byte_s
            answer = answers.get(request)
            if answer is None:
                answer = answers[request] = compose(request)
            for at in range(0, len(answer), USB_BYTES):
                part = answer[at : at + USB_BYTES]
                free_s += len(part) * byte_s
                due.append((free_s, part))


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
