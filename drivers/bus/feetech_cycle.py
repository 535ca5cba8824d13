"""The control cycle of Feetech servos: ``ControlCycle`` with Feetech's packets.

It converts blocks to little-endian two's complement, and the state to the layout of Protocol 2.0.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from snakewalk.config.arrays import Bytes, Int32s
from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.fast_path import FastPath
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.bus.pending_replies import PendingReplies
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.feetech import (
    STATUS_BYTES,
    BlockFormat,
    FeetechInstruction,
    FeetechParser,
    encode_word,
)
from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID, HEADER, frame

MOST_ENTRIES = 240
"""Bytes of entries in one sync write (ours): the length field counts up to 255."""
Convert = Callable[[Bytes], Bytes]


class FeetechReadRequest(GroupReadRequest):
    """Sync read of ``length`` bytes at ``address`` from ``ids``, or a read of one servo."""

    header = HEADER
    parser = FeetechParser

    def __init__(self, ids: Sequence[int], address: int, length: int, *, is_single: bool) -> None:
        span = bytes((address, length))
        if is_single:
            self.packet = frame(ids[0], FeetechInstruction.READ, span)
        else:
            self.packet = frame(BROADCAST_ID, FeetechInstruction.SYNC_READ, span + bytes(ids))
        self.fast = False
        self.frame_bytes = STATUS_BYTES + length
        self.ids = tuple(ids)
        self.length = length
        self._index = {servo_id: k for k, servo_id in enumerate(ids)}
        self.reply_bytes = len(self.ids) * self.frame_bytes

    def parse(self, raw: bytes) -> GroupReadReply:
        """Find each servo's result in the bytes."""
        reader = FeetechParser()
        by_id, unexpected = self._in_turn(reader.feed(raw))
        unexpected += reader.dropped_bytes + reader.pending
        reply = self._partial(by_id, clean=not unexpected)
        if unexpected or not reply.valid.all():
            return reply
        return reply._replace(whole=True, flawless=not reply.error.any())


class FeetechWrite(GroupWrite):
    """Sync write of one register to ``ids``."""

    def __init__(self, ids: Sequence[int], name: str, facts: ServoModel) -> None:
        self._ids = tuple(ids)
        self._name = name
        self._facts = facts
        self._row: RegisterRow = facts.registers[name]
        self.size = len(self.encode(np.zeros(len(ids), np.int32)))

    def encode(self, values: Int32s) -> bytes:
        """Packets that write ``values`` (N,)."""
        row = self._row
        entry_bytes = 1 + self._row.size
        entries = b"".join(
            bytes((servo_id,)) + encode_word(int(value), row, self._facts, self._name)
            for servo_id, value in zip(self._ids, values, strict=True)
        )
        head = bytes((row.address, row.size))
        step = MOST_ENTRIES // entry_bytes * entry_bytes
        return b"".join(
            frame(BROADCAST_ID, FeetechInstruction.SYNC_WRITE, head + entries[start : start + step])
            for start in range(0, len(entries), step)
        )


class FeetechCycle(ControlCycle):
    """Goals and a converted block of Feetech servos, by sync read."""

    def __init__(
        self,
        port: BytePort,
        ids: Sequence[int],
        facts: ServoModel,
        span: tuple[int, int],
        convert: Convert,
        *,
        latency_s: float,
        pending: PendingReplies,
        line: LineReservation,
    ) -> None:
        """Prepare the packets.

        ``span`` is address and length of the block on the wire. ``convert`` maps it (N, length) to
        the returned block (N, n).
        """
        self._facts = facts
        self._convert = convert
        self._clock = port.clock
        super().__init__(
            port,
            ids,
            registers=(0, *span),
            fast=False,
            latency_s=latency_s,
            pending=pending,
            line=line,
        )

    def finish_read(self) -> GroupReadReply:
        """Receive the converted reply to the request of ``begin_read``."""
        reply = super().finish_read()
        return reply._replace(data=self._convert(reply.data))

    def _goal_write(self, ids: Sequence[int], address: int) -> GroupWrite:
        del address
        return FeetechWrite(ids, "Goal Position", self._facts)

    def _read_request(self, ids: Sequence[int], length: int, *, fast: bool) -> GroupReadRequest:
        del fast
        is_single = len(ids) == 1 and not self._facts.sync_read
        return FeetechReadRequest(ids, self.read_address, length, is_single=is_single)

    def _native_path(self, spin_s: float | None) -> FastPath | None:
        del spin_s
        return None


class FeetechSingleReads(FeetechCycle):
    """Cycle of servos without sync read: goals by sync write, then one read per servo."""

    def __init__(
        self,
        port: BytePort,
        ids: Sequence[int],
        facts: ServoModel,
        span: tuple[int, int],
        convert: Convert,
        *,
        latency_s: float,
        pending: PendingReplies,
        line: LineReservation,
    ) -> None:
        """Prepare the packets; arguments as ``FeetechCycle``."""
        make = partial(FeetechCycle, latency_s=latency_s, pending=pending, line=line)
        self._singles = [make(port, (servo_id,), facts, span, convert) for servo_id in ids]
        super().__init__(
            port, ids, facts, span, convert, latency_s=latency_s, pending=pending, line=line
        )
        for single in self._singles:
            single.counters = self.counters
        self._begun_s = self._clock.now_s()

    @property
    def since_sent_s(self) -> float:
        """Largest possible age of the values of a read, s."""
        return self._clock.now_s() - self._begun_s

    def begin_read(self, goals: Int32s | None = None) -> None:
        """Send goals (N,) if given; ``finish_read`` asks the servos."""
        if goals is not None:
            self.write_goals(goals)
        self._begun_s = self._clock.now_s()

    def finish_read(self) -> GroupReadReply:
        """Read each servo."""
        replies = zip(*(single.read() for single in self._singles), strict=True)
        data, valid, error, answered, clean, whole, flawless = replies
        return GroupReadReply(
            np.concatenate(data),
            np.concatenate(valid),
            np.concatenate(error),
            np.concatenate(answered),
            all(clean),
            all(whole),
            all(flawless),
        )


def state_convert(facts: ServoModel, first: str) -> tuple[tuple[int, int], Convert]:
    """Span of the state block on the wire, and its conversion to the layout of Protocol 2.0.

    ``first`` is Present Current, or Present Load.
    """
    rows = [facts.registers[name] for name in (first, "Present Velocity", "Present Position")]
    address = min(row.address for row in rows)
    length = max(row.address + row.size for row in rows) - address
    block = BlockFormat(facts, address, length)
    places = [(row.address - address, size) for row, size in zip(rows, (2, 4, 4), strict=True)]

    def convert(data: Bytes) -> Bytes:
        plain = block.convert(data)
        parts = []
        for offset, size in places:
            word = np.ascontiguousarray(plain[:, offset : offset + 2]).view("<i2")[:, 0]
            column = np.ascontiguousarray(word.astype(f"<i{size}"))
            parts.append(column.view(np.uint8).reshape(-1, size))
        return np.ascontiguousarray(np.concatenate(parts, axis=1))

    return (address, length), convert


def supply_convert(facts: ServoModel) -> tuple[tuple[int, int], Convert]:
    """Span of voltage and temperature on the wire, and its conversion (2 and 1 bytes)."""
    volts, celsius = (
        facts.registers[name] for name in ("Present Input Voltage", "Present Temperature")
    )

    def convert(data: Bytes) -> Bytes:
        zero = np.zeros(len(data), np.uint8)
        return np.stack([data[:, 0], zero, data[:, celsius.address - volts.address]], axis=1)

    return (volts.address, celsius.address + celsius.size - volts.address), convert
