"""Cycles while all goes as it should, nearly all of it compiled.

It takes only what is exactly as expected. Anything else is handed back as it came, and the careful
way of ``GroupCycle`` goes on with it.
"""

import numpy as np
from numba import boolean, int32, int64, intp, types, uint8, uintp
from numpy.typing import NDArray

from snakewalk.config.arrays import Bytes
from snakewalk.drivers.bus.group_read import GroupAnswer, GroupQuestion
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.compiling import compiled
from snakewalk.drivers.port.byte_port import FilePort
from snakewalk.drivers.port.serial_wait import listen, now_ns, put
from snakewalk.drivers.protocol.frames import FLAWLESS, HEAD, IRREGULAR, fill, read_fast, read_plain

_NO_GOALS = np.zeros(0, np.int32)
_BITS_NS = 10_000_000_000
"""Ten bits a byte: times bytes, by the baud rate."""


HABIT = 0
"""In a plan, 2 numbers: as ``new_habit`` makes them."""
FREE_NS, BEGUN_NS, LEFT_NS = 2, 3, 4
"""When what was sent has left the line; when the question was put; after a cycle that went wrong,
how long its answer may still take."""
WRITE_BYTES, ASK_BYTES, HEADS_END, IDS_END, ERROR_END = 5, 6, 7, 8, 9
"""Length of the sync write and of the question behind it; where in ``work`` the heads that an
answer must have end, the IDs, and the error bytes; behind them is the answer."""
FAST = 10
"""1: the answer is one to a fast read."""
WRITE_NS, ASK_NS, ANSWER_NS, LATENCY_NS = 11, 12, 13, 14
"""How long the packets are on the line, and what may delay the answer."""
SPIN_NS = 15
"""As ``listen`` has it."""
PLAN_SIZE = 16
_write = types.ExternalFunction("write", intp(int32, intp, uintp))
_ROW, _ROWS = uint8[::1], uint8[:, ::1]


@compiled(int64(int64[::1], int64, int64))
def _occupy(plan: NDArray[np.int64], from_ns: int, wire_ns: int) -> int:
    """Note what was sent at ``from_ns``; how long from then until it has left the line, ns."""
    plan[FREE_NS] = max(from_ns, plan[FREE_NS]) + wire_ns
    return int(plan[FREE_NS] - from_ns)


@compiled(int64(int32, _ROW, int32[::1], int64[::1]))
def _send(fd: int, work: Bytes, values: NDArray[np.int32], plan: NDArray[np.int64]) -> int:
    """Put ``values`` into the sync write and send it; how many bytes were taken.

    None are where the frame must be stuffed, or the device is gone or full.
    """
    frame = work[: plan[WRITE_BYTES]]
    if not fill(frame, values):
        return 0
    begun_ns = now_ns()
    sent = max(0, int(_write(fd, frame.ctypes.data, len(frame))))
    if sent > 0:
        _occupy(plan, begun_ns, plan[WRITE_NS])
    return sent


@compiled(int64(int32, _ROW, int32[::1], int64[::1]))
def _ask(fd: int, work: Bytes, values: NDArray[np.int32], plan: NDArray[np.int64]) -> int:
    """Put the question, behind ``values`` if there are any; how many bytes were taken.

    What had come before is thrown away.
    """
    begin = int(plan[WRITE_BYTES])
    end = begin + int(plan[ASK_BYTES])
    if len(values) > 0:
        if not fill(work[:begin], values):
            return 0
        begin = 0
    plan[BEGUN_NS] = now_ns()
    return int(put(fd, work[begin:end]))


@compiled(int64(int32, _ROW, _ROWS, boolean, int64[::1]), nogil=True)
def _hear(fd: int, work: Bytes, data: Bytes, with_goals: bool, plan: NDArray[np.int64]) -> int:
    """Wait for the answer, and read it.

    Args:
        fd: does not block.
        work: packets, what is expected, and what has come, in the order that the plan says.
        data: (N, length) filled, unless irregular.
        with_goals: whether the question went behind goals.
        plan: (``PLAN_SIZE``,) the numbers above.

    Returns:
        What the frame reader says of a complete answer; ``-1 - n``: only ``n`` bytes have come.

    """
    begun_ns, wire_ns = int(plan[BEGUN_NS]), int(plan[ASK_NS])
    if with_goals:
        wire_ns += int(plan[WRITE_NS])
    least_ns = _occupy(plan, begun_ns, wire_ns) + int(plan[ANSWER_NS])
    wait_ns = least_ns + int(plan[LATENCY_NS])
    asked = int(plan[WRITE_BYTES] + plan[ASK_BYTES])
    heads_end, ids_end, error_end = plan[HEADS_END], plan[IDS_END], plan[ERROR_END]
    answer, error = work[error_end:], work[ids_end:error_end]
    habit = plan[HABIT : HABIT + 2]
    got = listen(fd, answer, begun_ns, least_ns, wait_ns, plan[SPIN_NS], habit)
    if got < len(answer):
        found = -1 - int(got)
    elif plan[FAST]:
        head, ids = work[asked:heads_end], work[heads_end:ids_end]
        found = int(read_fast(answer, head, ids, data, error))
    else:
        heads = work[asked:heads_end].reshape(len(data), HEAD)
        found = int(read_plain(answer, heads, data, error))
    if found <= 0:
        plan[LEFT_NS] = begun_ns + wait_ns - now_ns()
    return found


class Express:
    """One question to servos on ``port``, alone or behind their goals."""

    def __init__(
        self,
        port: FilePort,
        goals: GroupWrite,
        question: GroupQuestion,
        *,
        delay_s: float,
        latency_s: float,
        spin_s: float,
    ) -> None:
        """Prepare the packets.

        Args:
            port: with a file.
            goals: what ``write`` and ``turn`` send.
            question: what is asked.
            delay_s: of the servos, in one answer.
            latency_s: as ``GroupCycle`` has it.
            spin_s: as ``GroupCycle`` has it.

        """
        self._port, self._question = port, question
        count = len(question.ids)
        self._values = np.zeros(count, np.int32)
        self._shape = (count, question.length)
        head = goals.template(), question.request, question.heads, question.ids
        parts = [np.frombuffer(bytes(part), np.uint8) for part in head]
        ends = np.cumsum([len(part) for part in parts])
        answer_at = int(ends[3]) + count
        self._work = np.zeros(answer_at + question.answer_bytes, np.uint8)
        self._work[: ends[3]] = np.concatenate(parts)
        self._write_bytes, self._asked = int(ends[0]), int(ends[1])
        self._error, self._answer = self._work[ends[3] : answer_at], self._work[answer_at:]
        self._plan = np.zeros(PLAN_SIZE, np.int64)
        self._plan[WRITE_BYTES], self._plan[ASK_BYTES] = ends[0], ends[1] - ends[0]
        self._plan[HEADS_END : ERROR_END + 1] = ends[2], ends[3], answer_at
        self._plan[FAST] = question.fast
        self._plan[LATENCY_NS], self._plan[SPIN_NS] = latency_s * 1e9, spin_s * 1e9
        self._delay_ns = int(delay_s * 1e9)
        self._baud = 0

    def occupy(self, wire_s: float) -> float:
        """Note that something else is sent now; how long until all has left the line, s."""
        return float(_occupy(self._plan, now_ns(), int(wire_s * 1e9)) * 1e-9)

    @property
    def left_s(self) -> float:
        """How long the answer to a cycle that went wrong may still take."""
        return float(self._plan[LEFT_NS] * 1e-9)

    def write(self, goals: NDArray[np.int32]) -> int:
        """Send goals (N,); how many bytes the device has taken, 0 if it must go another way."""
        fd = self._port.file
        if fd is None:
            return 0
        if self._port.getBaudRate() != self._baud:
            self._reckon()
        values = self._values
        values[:] = goals
        return int(_send(fd, self._work, values, self._plan))

    def turn(self, goals: NDArray[np.int32] | None) -> GroupAnswer | bytes | None:
        """Ask, behind ``goals`` (N,) if there are any.

        Returns:
            The answer; or what has come, if it is not as expected; or None if nothing was sent.

        Raises:
            PortError: the port is gone.

        """
        fd = self._port.file
        if fd is None:
            return None
        values = _NO_GOALS
        if goals is not None:
            values = self._values
            values[:] = goals
        work, plan = self._work, self._plan
        sent = _ask(fd, work, values, plan)
        # from here on the bytes are on the line: time that costs nothing
        begin = self._write_bytes if goals is None else 0
        if sent < self._asked - begin:
            if not sent:
                return None
            self._port.write(work[begin + sent : self._asked].tobytes())
        if self._port.getBaudRate() != self._baud:
            self._reckon()
        data = np.empty(self._shape, np.uint8)
        answer = self._question.regular(FLAWLESS, data, self._error)
        found = _hear(fd, work, data, goals is not None, plan)
        if found == FLAWLESS:
            return answer
        if found > IRREGULAR:
            return self._question.regular(found, data, self._error)
        return self._answer[: None if found == IRREGULAR else -1 - found].tobytes()

    def _reckon(self) -> None:
        """Times on the line at the port's present speed."""
        self._baud = baud = self._port.getBaudRate()
        plan = self._plan
        for time, count in ((WRITE_NS, plan[WRITE_BYTES]), (ASK_NS, plan[ASK_BYTES])):
            plan[time] = int(count) * _BITS_NS // baud
        plan[ANSWER_NS] = len(self._answer) * _BITS_NS // baud + self._delay_ns
