"""Cycles while all goes as it should, nearly all of it compiled (``drivers.compiled_cycle``).

It takes only what is exactly as expected. Anything else is handed back as it came, and the careful
way of ``GroupCycle`` goes on with it.
"""

import numpy as np
from numpy.typing import NDArray

from drivers import compiled_cycle as c
from drivers.compiled_exchange import now_ns
from drivers.group_answer import GroupAnswer, GroupQuestion
from drivers.group_write import GroupWrite
from drivers.port import FilePort
from drivers.protocol.group_frames import FLAWLESS, IRREGULAR

_NO_GOALS = np.zeros(0, np.int32)
_BITS_NS = 10_000_000_000
"""Ten bits a byte: times bytes, by the baud rate."""


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
        self._plan = np.zeros(c.PLAN_SIZE, np.int64)
        self._plan[c.WRITE_BYTES], self._plan[c.ASK_BYTES] = ends[0], ends[1] - ends[0]
        self._plan[c.HEADS_END : c.ERROR_END + 1] = ends[2], ends[3], answer_at
        self._plan[c.FAST] = question.fast
        self._plan[c.LATENCY_NS], self._plan[c.SPIN_NS] = latency_s * 1e9, spin_s * 1e9
        self._delay_ns = int(delay_s * 1e9)
        self._baud = 0

    def occupy(self, wire_s: float) -> float:
        """Note that something else is sent now; how long until all has left the line, s."""
        return float(c.occupy(self._plan, now_ns(), int(wire_s * 1e9)) * 1e-9)

    @property
    def left_s(self) -> float:
        """How long the answer to a cycle that went wrong may still take."""
        return float(self._plan[c.LEFT_NS] * 1e-9)

    def write(self, goals: NDArray[np.int32]) -> int:
        """Send goals (N,); how many bytes the device has taken, 0 if it must go another way."""
        fd = self._port.file
        if fd is None:
            return 0
        if self._port.getBaudRate() != self._baud:
            self._reckon()
        values = self._values
        values[:] = goals
        return int(c.send(fd, self._work, values, self._plan))

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
        sent = c.ask(fd, work, values, plan)
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
        found = c.hear(fd, work, data, goals is not None, plan)
        if found == FLAWLESS:
            return answer
        if found > IRREGULAR:
            return self._question.regular(found, data, self._error)
        return self._answer[: None if found == IRREGULAR else -1 - found].tobytes()

    def _reckon(self) -> None:
        """Times on the line at the port's present speed."""
        self._baud = baud = self._port.getBaudRate()
        plan = self._plan
        for time, count in ((c.WRITE_NS, plan[c.WRITE_BYTES]), (c.ASK_NS, plan[c.ASK_BYTES])):
            plan[time] = int(count) * _BITS_NS // baud
        plan[c.ANSWER_NS] = len(self._answer) * _BITS_NS // baud + self._delay_ns
