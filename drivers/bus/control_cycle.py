"""The control cycle on the wire: goals to all servos, the state block from all of them.

Rules, each against something that happens on real buses:

- Servos answer a group read in turn, each after the one before, so those behind a silent one stay
  silent as well: it is asked last from then on, and costs its own value only.
- After anything but a complete clean answer the line is drained until quiet.
- An answer older than its question is never taken for new. Draining alone cannot promise that (an
  adapter may stall for longer), so after a failure the block asked for has another length, one of
  which no answer is open (``pending_replies``): what comes late has the wrong one and is dropped.
- Fast reads that keep failing are given up for plain ones, where damage ends with its packet.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.drivers.bus.group_read import GroupAnswer, GroupQuestion
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.pending_replies import Debts
from snakewalk.drivers.bus.serial_fast_path import Express
from snakewalk.drivers.port.byte_port import AskingPort, BytePort, FilePort

_PATIENCE = 3
"""Reads in a row after which a silent servo no longer has a say in the length."""
_KEPT_QUESTIONS = 64
SPIN_S = 40e-6
"""About how late a program is woken; awake sooner, it costs more of the processor than it saves."""


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
        debts: Debts | None = None,
        spin_s: float = SPIN_S,
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
            clean_reads: clean reads in a row until the order is the usual one again.
            debts: answers still open on this port, shared by all who ask on it; None: nobody else.
            spin_s: on a device, sleep until so long before the answer should be complete, then look
                without sleeping, at most twice as long: shorter cycles, more CPU; 0: sleep always.

        """
        self._port = port
        self._asking = port if isinstance(port, AskingPort) else None
        self._count = len(ids)
        self._goals = GroupWrite(ids, goal_address)
        self._express: Express | None = None
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
        self._debts = debts if debts is not None else Debts(port.clock)
        self._missed = np.zeros(len(ids), np.intp)
        self._sent_until_s = port.clock.now_s()
        self._usual = GroupQuestion(ids, read_address, read_bytes, fast=fast)
        if isinstance(port, FilePort) and port.file is not None:
            delay_s = self._delay_s(self._usual)
            self._express = Express(
                port, self._goals, self._usual, delay_s=delay_s, latency_s=latency_s, spin_s=spin_s
            )
        self.fast = fast
        """Whether the next read is a fast one."""
        self.counters = CycleCounters()

    def write_goals(self, goals: NDArray[np.int32]) -> None:
        """Send raw goals (N,); servos do not answer a sync write."""
        if self._express is None:
            self._send(self._goals.encode(goals))
            return
        sent = self._express.write(goals)
        if not sent:
            self._send(self._goals.encode(goals))
        elif sent < self._goals.size:
            self._port.write(self._goals.encode(goals)[sent:])

    def turn(self, goals: NDArray[np.int32]) -> GroupAnswer:
        """``write_goals`` and ``read`` in one: both packets leave in one write, back to back.

        Raises:
            PortError: the port is gone.

        """
        return self._read(goals)

    def read(self) -> GroupAnswer:
        """Ask all servos for their block; ``data`` is (N, read_bytes).

        Raises:
            PortError: the port is gone.

        """
        return self._read(None)

    def _read(self, goals: NDArray[np.int32] | None) -> GroupAnswer:
        """Ask, behind goals if there are any."""
        self.counters.reads += 1
        express, question, order = self._express, self._question(), self._order
        raw = None
        if express is not None and question is self._usual:
            found = express.turn(goals)
            if isinstance(found, GroupAnswer):
                self._succeeded()
                return found
            if found is not None:
                raw, answer = self._go_on(question, found, express.left_s)
        if raw is None:
            raw, answer = self._ask(question, goals)
        heard = answer.answered
        if not self._debts.none:
            answer = self._believed(question, answer)
        if answer.clean and answer.complete:
            self._succeeded()
        else:
            self._failed(question, answer, heard, timed_out=len(raw) < question.answer_bytes)
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

    def _believed(self, question: GroupQuestion, answer: GroupAnswer) -> GroupAnswer:
        """The answer without what may be that to an older question."""
        known = np.array(
            [not self._debts.open(i, question.length, fast=question.fast) for i in question.ids]
        )
        if known.all():
            return answer
        error = np.where(known, answer.error, 0).astype(np.uint8)
        return GroupAnswer(
            answer.data, answer.valid & known, error, answer.answered & known, clean=False
        )

    def _question(self) -> GroupQuestion:
        length = self._length
        if self._order is self._natural and self.fast is self._usual.fast and self._debts.none:
            return self._usual
        if not self._debts.none:
            listening = [self._ids[k] for k in np.flatnonzero(self._missed < _PATIENCE)]
            length = self._debts.free_length(listening, length, fast=self.fast)
        key = (self.fast, length, self._order)
        question = self._questions.get(key)
        if question is None:
            if len(self._questions) >= _KEPT_QUESTIONS:
                self._questions.clear()
            ids = [self._ids[k] for k in self._order]
            question = GroupQuestion(ids, self._read_address, length, fast=self.fast)
            self._questions[key] = question
        return question

    def _send(self, packet: bytes) -> None:
        self._note_sent(len(packet))
        self._port.write(packet)

    def _note_sent(self, count: int) -> float:
        """Note when bytes will have left the host (a write does not wait for that); and now."""
        now_s, wire_s = self._port.clock.now_s(), self._wire_s(count)
        if self._express is None:
            self._sent_until_s = max(now_s, self._sent_until_s) + wire_s
        else:
            self._sent_until_s = now_s + self._express.occupy(wire_s)
        return now_s

    def _go_on(
        self, question: GroupQuestion, raw: bytes, left_s: float
    ) -> tuple[bytes, GroupAnswer]:
        """Take what still comes to what has come."""
        deadline_s, missing = self._port.clock.now_s() + left_s, question.answer_bytes - len(raw)
        if missing > 0:
            raw += self._port.read_until(missing, deadline_s)
        return self._complete(question, raw, deadline_s)

    def _answer_s(self, question: GroupQuestion) -> float:
        """How long the answer takes, return delays included."""
        return self._wire_s(question.answer_bytes) + self._delay_s(question)

    def _delay_s(self, question: GroupQuestion) -> float:
        return (1 if question.fast else self._count) * self._return_delay_s

    def _ask(
        self, question: GroupQuestion, goals: NDArray[np.int32] | None
    ) -> tuple[bytes, GroupAnswer]:
        """Ask, and take all that comes until the answer is complete or the deadline has passed."""
        port, before = self._port, b"" if goals is None else self._goals.encode(goals)
        request = before + question.request
        wait_s = self._answer_s(question)
        if self._asking is not None:
            now_s = self._note_sent(len(request))
            deadline_s = self._sent_until_s + wait_s + self._latency_s
            raw = self._asking.ask(request, question.answer_bytes, deadline_s - now_s)
        else:
            port.clearPort()
            self._send(request)
            deadline_s = self._sent_until_s + wait_s + self._latency_s
            raw = port.read_until(question.answer_bytes, deadline_s)
        return self._complete(question, raw, deadline_s)

    def _complete(
        self, question: GroupQuestion, raw: bytes, deadline_s: float
    ) -> tuple[bytes, GroupAnswer]:
        """Read the answer, and take what stuffing has added to it."""
        answer = question.parse(raw)
        while len(raw) >= question.answer_bytes and not answer.complete:
            more = question.missing_bytes(raw)  # stuffed bytes come on top
            got = self._port.read_until(more, deadline_s + self._wire_s(more)) if more else b""
            if not got:
                break
            raw += got
            answer = question.parse(raw)
        return raw, answer

    def _wire_s(self, count: int) -> float:
        return count * 10.0 / self._port.getBaudRate()

    def _succeeded(self) -> None:
        self._clean_in_a_row += 1
        if self._clean_in_a_row == 1:
            self._failed_in_a_row = 0
            self._missed[:] = 0
        if self._clean_in_a_row >= self._clean_reads:
            self._order = self._natural

    def _failed(
        self,
        question: GroupQuestion,
        answer: GroupAnswer,
        heard: NDArray[np.bool_],
        *,
        timed_out: bool,
    ) -> None:
        """Count, and prepare for what may still come; ``heard`` is who said anything at all."""
        self.counters.timeouts += timed_out
        self.counters.unclean += not timed_out
        self._clean_in_a_row = 0
        self._failed_in_a_row += 1
        if self.fast and self._failed_in_a_row >= self._fast_failures:
            self.fast = False
            self.counters.fast_given_up += 1
        order = self._order
        asked = list(order)
        self._missed[asked] = np.where(heard, 0, self._missed[asked] + 1)
        missing = np.flatnonzero(~answer.answered)
        self._debts.owe([question.ids[k] for k in missing], question.length, fast=question.fast)
        if not heard.all():
            first = int(np.argmin(heard))  # those behind it had no chance
            self._order = (*order[:first], *order[first + 1 :], order[first])
        self.counters.drained_bytes += self._port.drain_until_quiet(self._latency_s)
