"""The control cycle on the wire: goals to all servos, the state block from all of them.

Rules, each against something that happens on real buses:

- Servos answer a group read in turn, each after the one before, so those behind a silent one stay
  silent as well: it is asked last from then on, and costs its own value only.
- After anything but a complete clean answer the line is drained until quiet.
- An answer older than its question is never taken for new. Draining alone cannot promise that (an
  adapter may stall for longer), so after every failure the block asked for changes its length: what
  comes late has the wrong one and is thrown away.
- Fast reads that keep failing are given up for plain ones, where damage ends with its packet.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.group_answer import GroupAnswer, GroupQuestion
from drivers.group_write import GroupWrite
from drivers.port import BytePort

_PADS = 3
"""Block lengths in turn: length, + 1, + 2."""
_KEPT_QUESTIONS = 64


@dataclass(slots=True)
class CycleCounters:
    """What went wrong so far."""

    reads: int = 0
    timeouts: int = 0
    """Reads whose deadline passed before all bytes had come."""
    unclean: int = 0
    """Reads with noise, damage, or late answers in them."""
    drained_bytes: int = 0
    fast_given_up: int = 0


class GroupCycle:
    """Goals at ``goal_address`` (4 bytes) and a block of ``read_bytes`` at ``read_address``."""

    def __init__(
        self,
        port: BytePort,
        ids: Sequence[int],
        *,
        goal_address: int = 116,
        read_address: int = 126,
        read_bytes: int = 10,
        fast: bool = True,
        latency_s: float = 0.004,
        return_delay_s: float = 0.0,
        fast_failures: int = 3,
        clean_reads: int = 50,
    ) -> None:
        """Prepare the packets.

        Args:
            port: the line.
            ids: servos, in the order of all arrays here.
            goal_address: of the goal register, 4 bytes.
            read_address: of the block.
            read_bytes: its length.
            fast: begin with fast sync read.
            latency_s: how long adapter and driver may hold bytes back, at most.
            return_delay_s: of each servo.
            fast_failures: fast reads failing in a row until plain ones are used.
            clean_reads: clean reads in a row until order and length are the usual ones again.

        """
        self._port = port
        self._count = len(ids)
        self._goals = GroupWrite(ids, goal_address)
        self._ids = tuple(ids)
        self._natural = tuple(range(len(ids)))
        self._order = self._natural
        self._questions: dict[tuple[bool, int, tuple[int, ...]], GroupQuestion] = {}
        self._read_address = read_address
        self._length = read_bytes
        self._latency_s = latency_s
        self._return_delay_s = return_delay_s
        self._fast_failures = fast_failures
        self._clean_reads = clean_reads
        self._failed_in_a_row = 0
        self._clean_in_a_row = 0
        self._pad = 0
        self._sent_until_s = port.clock.now_s()
        self.fast = fast
        """Whether the next read is a fast one."""
        self.counters = CycleCounters()

    def write_goals(self, goals: NDArray[np.int32]) -> None:
        """Send raw goals (N,); servos do not answer a sync write."""
        self._send(self._goals.encode(goals))

    def read(self) -> GroupAnswer:
        """Ask all servos for their block; ``data`` is (N, read_bytes).

        Raises:
            PortError: the port is gone.

        """
        question, order = self._question(), self._order
        self.counters.reads += 1
        self._port.clearPort()
        self._send(question.request)
        raw, answer = self._collect(question)
        if answer.clean and answer.answered.all():
            self._succeeded()
        else:
            self._failed(answer, timed_out=len(raw) < question.answer_bytes)
        if order == self._natural and self._length == answer.data.shape[1]:
            return answer
        back = np.argsort(order)
        return GroupAnswer(
            answer.data[back, : self._length],
            answer.valid[back],
            answer.error[back],
            answer.answered[back],
            answer.clean,
        )

    def _question(self) -> GroupQuestion:
        key = (self.fast, self._pad, self._order)
        question = self._questions.get(key)
        if question is None:
            if len(self._questions) >= _KEPT_QUESTIONS:
                self._questions.clear()
            ids = [self._ids[k] for k in self._order]
            length = self._length + self._pad
            question = GroupQuestion(ids, self._read_address, length, fast=self.fast)
            self._questions[key] = question
        return question

    def _send(self, packet: bytes) -> None:
        """Write, and note when it will have left the host (a write does not wait for that)."""
        now_s = self._port.clock.now_s()
        self._port.write(packet)
        self._sent_until_s = max(now_s, self._sent_until_s) + self._wire_s(len(packet))

    def _collect(self, question: GroupQuestion) -> tuple[bytes, GroupAnswer]:
        """All that comes until the answer is complete or the deadline has passed."""
        port = self._port
        delays = 1 if question.fast else self._count
        wait_s = self._wire_s(question.answer_bytes) + delays * self._return_delay_s
        deadline_s = self._sent_until_s + wait_s + self._latency_s
        raw = port.read_until(question.answer_bytes, deadline_s)
        answer = question.parse(raw)
        while len(raw) >= question.answer_bytes and not answer.answered.all():
            more = question.missing_bytes(raw)  # stuffed bytes come on top
            got = port.read_until(more, deadline_s + self._wire_s(more)) if more else b""
            if not got:
                break
            raw += got
            answer = question.parse(raw)
        return raw, answer

    def _wire_s(self, count: int) -> float:
        return count * 10.0 / self._port.getBaudRate()

    def _succeeded(self) -> None:
        self._failed_in_a_row = 0
        self._clean_in_a_row += 1
        if self._clean_in_a_row >= self._clean_reads:
            self._pad, self._order = 0, self._natural

    def _failed(self, answer: GroupAnswer, *, timed_out: bool) -> None:
        self.counters.timeouts += timed_out
        self.counters.unclean += not timed_out
        self._clean_in_a_row = 0
        self._failed_in_a_row += 1
        if self.fast and self._failed_in_a_row >= self._fast_failures:
            self.fast = False
            self.counters.fast_given_up += 1
        self._pad = (self._pad + 1) % _PADS
        if not answer.answered.all():
            first = int(np.argmin(answer.answered))  # those behind it had no chance
            order = self._order
            self._order = (*order[:first], *order[first + 1 :], order[first])
        self.counters.drained_bytes += self._port.drain_until_quiet(self._latency_s)
