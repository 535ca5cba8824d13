"""The control cycle on the wire: goals to all servos, then a read of their state blocks.

- In a group read the servos after a silent one do not reply, so requests list it last.
- After an incomplete or damaged reply the cycle discards bytes until the line is quiet.
- An adapter may stall for longer. After a failure, requests have a length that no pending reply has
  (``pending_replies``), so a late reply has the wrong length.
- A repeated reply arrives sooner than the line could carry it, or adds surplus bytes.
- After repeated failures plain reads replace fast ones: damage then affects only one packet.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bools, Int32s
from snakewalk.drivers.bus.fast_path import FastPath, FastPathPort
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.bus.pending_replies import SPARE_LENGTHS, PendingReplies
from snakewalk.drivers.compiling import is_compiling
from snakewalk.drivers.port.byte_port import BytePort, DescriptorPort
from snakewalk.drivers.protocol.frames import HEAD
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE

_IS_LINUX = sys.platform.startswith("linux")
FAST_FAILURES = 3
"""Fast reads failing in a row until plain ones are used (ours)."""
_CLEAN_READS = 50
"""Clean reads in a row until the default order is used again (ours)."""
_MISSED_LIMIT = 3
"""Missed reads in a row after which a silent servo is ignored in the choice of the length."""
_KEPT_REQUESTS = 64
STALL_S = 0.02
"""A wait that ends this long after its deadline is a stall of the computer (ours)."""
SPIN_S = 40e-6
"""Typical delay, s, with which Linux wakes a program."""
SPIN_FROM_BAUD = 3_000_000
"""Lowest baud rate at which a cycle polls: at 1 Mbaud polling is half of a read's CPU time, and
saves
10 us of 4 ms."""


@dataclass(slots=True)
class CycleCounters:
    """Irregular reads so far."""

    timeouts: int = 0
    """Reads whose deadline passed before all bytes had arrived."""
    unclean: int = 0
    """Reads with noise, damage, or late replies in them."""
    copies: int = 0
    """Older replies that had come twice, and were dropped."""
    fast_given_up: int = 0
    late_bytes: int = 0
    """Bytes that arrived after the time-out of their read."""
    stalled_s: float = 0.0
    """Total time between the deadlines and the ends of reads that ended long after them: this
    program or its computer paused."""


class ControlCycle:
    """Writes the goals of servos, and reads one block of registers from each."""

    def __init__(
        self,
        port: BytePort,
        ids: Sequence[int],
        *,
        registers: tuple[int, int, int] = (116, 126, 10),
        fast: bool = True,
        latency_s: float = 0.004,
        pending: PendingReplies | None = None,
        line: LineReservation | None = None,
        spin_s: float | None = None,
    ) -> None:
        """Prepare the packets.

        Args:
            port: the line; its servos have a return delay of 0.
            ids: servos, in the order of all arrays.
            registers: address of the goal, 4 bytes; address and length of the block.
            fast: begin with fast sync read.
            latency_s: largest delay of adapter and driver.
            pending: pending replies of this port, shared by all senders; None: this cycle is alone.
            line: reservation of this port's line, shared likewise.
            spin_s: on a device, poll from this time before the expected end of the reply, for at
                most twice the time. 0: always sleep. None: ``SPIN_S`` from ``SPIN_FROM_BAUD``, else
                0.

        """
        self._port = port
        goal_address, self.read_address, self.read_bytes = registers
        """First address and length of the block."""
        self._goals = self._goal_write(ids, goal_address)
        self._ids = tuple(ids)
        self._default_order = tuple(range(len(ids)))
        self._order = self._default_order
        self._requests: dict[tuple[bool, int, tuple[int, ...]], GroupReadRequest] = {}
        self._latency_s = latency_s
        self._failed_in_a_row = 0
        self._clean_in_a_row = 0
        self._pending = pending if pending is not None else PendingReplies(port.clock)
        self._missed = np.zeros(len(ids), np.intp)
        self._line = line or LineReservation(port.clock, paced=port.paced)
        self._default_request = self._read_request(ids, self.read_bytes, fast=fast)
        self._fast_path = self._native_path(spin_s)
        self._awaited: tuple[GroupReadRequest, tuple[int, ...], FastPath | float] = (
            self._default_request,
            self._default_order,
            port.clock.now_s(),
        )
        """Request whose reply is awaited, its order, and its receiver or deadline."""
        self.fast = fast
        """Whether the next read is a fast one."""
        self.counters = CycleCounters()

    def _goal_write(self, ids: Sequence[int], address: int) -> GroupWrite:
        return GroupWrite(ids, address)

    def _read_request(self, ids: Sequence[int], length: int, *, fast: bool) -> GroupReadRequest:
        return GroupReadRequest(ids, self.read_address, length, fast=fast)

    def _native_path(self, spin_s: float | None) -> FastPath | None:
        """Fast path of the port; None if it must use the port's own calls."""
        port = self._port
        latency_s = self._latency_s
        packets = self._goals, self._default_request, self._line
        if isinstance(port, FastPathPort):
            return port.fast_path(*packets, latency_s=latency_s)
        if (
            isinstance(port, DescriptorPort)
            and port.descriptor is not None
            and self._line.zero_s is not None
            and _IS_LINUX
            and is_compiling()
        ):
            from snakewalk.drivers.bus.serial_fast_path import SerialFastPath  # noqa: PLC0415  its loops call Linux

            if spin_s is None:
                spin_s = SPIN_S if port.getBaudRate() >= SPIN_FROM_BAUD else 0.0
            return SerialFastPath(port, *packets, latency_s=latency_s, spin_s=spin_s)
        return None

    @property
    def given_up_on(self) -> tuple[str, ...]:
        """The port's name if fast reads were given up."""
        return (self._port.name,) if self.counters.fast_given_up else ()

    @property
    def since_sent_s(self) -> float:
        """Time since the last packet left the line, s.

        After a read it bounds the age of the values: no servo measures before the request.
        """
        return self._line.since_sent_s

    def write_goals(self, goals: Int32s) -> None:
        """Send raw goals (N,); servos do not reply to a sync write."""
        if self._fast_path is None:
            self._send(self._goals.encode(goals))
            return
        sent = self._fast_path.write(goals)
        if not sent:
            self._send(self._goals.encode(goals))
        elif sent < self._goals.size:
            self._port.write(self._goals.encode(goals)[sent:])

    def read(self, goals: Int32s | None = None) -> GroupReadReply:
        """Read the block of all servos; ``data`` is (N, read_bytes).

        Goals (N,) are sent first if given, with the request in one write.

        Raises:
            PortError: the port is gone.

        """
        self.begin_read(goals)
        return self.finish_read()

    def begin_read(self, goals: Int32s | None = None) -> None:
        """Send the request, after goals (N,) if given; ``finish_read`` returns the reply.

        Requests on other ports may begin between the two.

        Raises:
            PortError: the port is gone.

        """
        fast_path = self._fast_path
        request = self._next_request()
        if fast_path is not None and request is self._default_request and fast_path.begin(goals):
            self._awaited = request, self._order, fast_path
        else:
            self._awaited = request, self._order, self._begin_read(request, goals)

    def finish_read(self) -> GroupReadReply:
        """Receive the reply to the request of ``begin_read``.

        Raises:
            PortError: the port is gone.

        """
        request, order, by = self._awaited
        if isinstance(by, float):
            raw, reply = self._receive(request, b"", by)
        else:
            outcome = by.finish()
            if isinstance(outcome, GroupReadReply):
                self._note_stall(request)
                self._note_success()
                return outcome
            raw, reply = self._receive(request, outcome, self._port.clock.now_s() + by.remaining_s)
        self._note_stall(request)
        responded = reply.answered
        if not self._pending.empty:
            reply = self._without_late_replies(request, reply)
        if reply.clean and reply.complete:
            self._note_success()
        else:
            self._note_failure(request, reply, responded, timed_out=len(raw) < request.reply_bytes)
        if order == self._default_order and self.read_bytes == reply.data.shape[1]:
            return reply
        back = np.argsort(order)
        return GroupReadReply(
            reply.data[back, : self.read_bytes],
            reply.valid[back],
            reply.error[back],
            reply.answered[back],
            reply.clean,
        )

    def _note_stall(self, request: GroupReadRequest) -> None:
        allowed_s = request.reply_bytes * self._byte_s + self._latency_s
        late_s = self._line.since_sent_s - allowed_s
        if late_s > STALL_S:
            self.counters.stalled_s += late_s

    def _without_late_replies(
        self, request: GroupReadRequest, reply: GroupReadReply
    ) -> GroupReadReply:
        new = np.array(
            [
                not self._pending.is_pending(i, request.length, fast=request.fast)
                for i in request.ids
            ]
        )
        if new.all():
            return reply
        error = np.where(new, reply.error, 0).astype(np.uint8)
        return GroupReadReply(
            reply.data, reply.valid & new, error, reply.answered & new, clean=False
        )

    def _next_request(self) -> GroupReadRequest:
        """The default request, unless order, kind or length must differ."""
        length = self.read_bytes
        default = self._default_request
        none_pending = self._pending.empty
        if self._order is self._default_order and self.fast is default.fast and none_pending:
            return default
        if not none_pending:
            # on a silent bus keep some lengths for the reads after its first reply
            responding = [self._ids[k] for k in np.flatnonzero(self._missed < _MISSED_LIMIT)]
            spares = SPARE_LENGTHS
            if not responding:
                responding = [*self._ids]
                spares = SPARE_LENGTHS // 2
            length = self._pending.free_length(responding, length, fast=self.fast, spares=spares)
        key = (self.fast, length, self._order)
        request = self._requests.get(key)
        if request is None:
            if len(self._requests) >= _KEPT_REQUESTS:
                self._requests.clear()
            ids = [self._ids[k] for k in self._order]
            request = self._read_request(ids, length, fast=self.fast)
            self._requests[key] = request
        return request

    def _send(self, packet: bytes) -> None:
        self._line.reserve(len(packet) * self._byte_s)
        self._port.write(packet)

    def _begin_read(self, request: GroupReadRequest, goals: Int32s | None) -> float:
        packet = request.packet if goals is None else self._goals.encode(goals) + request.packet
        if self._failed_in_a_row:  # these bytes answer an older request
            self.counters.late_bytes += self._port.getBytesAvailable()
        self._port.clearPort()
        byte_s = self._byte_s
        free_s = self._line.reserve(len(packet) * byte_s)
        self._port.write(packet)
        return free_s + request.reply_bytes * byte_s + self._latency_s

    def _receive(
        self, request: GroupReadRequest, raw: bytes, deadline_s: float
    ) -> tuple[bytes, GroupReadReply]:
        port = self._port
        expected = request.reply_bytes
        if len(raw) < expected:
            raw += port.read_until(expected - len(raw), deadline_s)
        if len(raw) == expected and self._has_second_reply(request, deadline_s):
            raw = port.read_until(expected, deadline_s)
            self._line.note_copies(answered=len(raw) > 0)
            self.counters.copies += 1
        if len(raw) > expected or (len(raw) == expected and port.getBytesAvailable()):
            raw = self._with_surplus(request, raw, deadline_s)
        reply = request.parse(raw)
        while len(raw) >= request.reply_bytes and not reply.complete:
            more = request.missing_bytes(raw)  # stuffed bytes or an older reply are additional
            surplus = len(raw) + more - expected
            received = (
                self._port.read_until(more, deadline_s + surplus * self._byte_s) if more else b""
            )
            if not received:
                break
            raw += received
            reply = request.parse(raw)
        return raw, reply

    def _with_surplus(self, request: GroupReadRequest, raw: bytes, deadline_s: float) -> bytes:
        port = self._port
        expected = request.reply_bytes
        if not request.parse(raw[:expected]).whole:
            return raw
        more_s = port.clock.now_s() + 2 * HEAD * self._byte_s
        raw += port.read_until(expected + HEAD - len(raw), more_s)
        if request.header not in raw[expected:]:
            return raw[:expected]  # noise, as when an adapter switches direction
        return raw + port.read_until(2 * expected - len(raw), deadline_s)

    def _has_second_reply(self, request: GroupReadRequest, deadline_s: float) -> bool:
        """Whether a reply that is complete now is an older one."""
        byte_s = self._byte_s
        reply_s = request.reply_bytes * byte_s
        free_s = deadline_s - reply_s - self._latency_s
        return self._line.has_second_reply(free_s, len(request.packet) * byte_s, reply_s)

    @property
    def _byte_s(self) -> float:
        return BITS_PER_BYTE / self._port.getBaudRate()

    def _note_success(self) -> None:
        self._clean_in_a_row += 1
        if self._clean_in_a_row == 1:
            self._failed_in_a_row = 0
            self._missed[:] = 0
        if self._clean_in_a_row >= _CLEAN_READS:
            self._order = self._default_order

    def _note_failure(
        self,
        request: GroupReadRequest,
        reply: GroupReadReply,
        responded: Bools,
        *,
        timed_out: bool,
    ) -> None:
        """Count, and prepare for late replies; ``responded`` marks servos with any reply."""
        self.counters.timeouts += timed_out
        self.counters.unclean += not timed_out
        self._clean_in_a_row = 0
        self._failed_in_a_row = 0 if reply.complete else self._failed_in_a_row + 1
        if self.fast and self._failed_in_a_row >= FAST_FAILURES:
            self.fast = False
            self.counters.fast_given_up += 1
        order = self._order
        asked = list(order)
        self._missed[asked] = np.where(responded, 0, self._missed[asked] + 1)
        missing = np.flatnonzero(~reply.answered)
        self._pending.add([request.ids[k] for k in missing], request.length, fast=request.fast)
        if not responded.all():
            first = int(np.argmin(responded))  # those after it could not respond
            self._order = (*order[:first], *order[first + 1 :], order[first])
        self.counters.late_bytes += timed_out * self._port.drain_until_quiet(self._latency_s)
