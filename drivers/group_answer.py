"""Answers of many servos to one (fast) sync read: bytes to one result per servo.

The plain case, all answers there and none stuffed, is one vectorised pass. Everything else goes
the slow way and yields what can be proved to belong to the question, servo by servo.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import crc16, crc16_long, crc16_rows
from drivers.protocol.packet import (
    BROADCAST_ID,
    HEADER,
    STATUS,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from drivers.protocol.parser import PacketReader

Bytes = NDArray[np.uint8]
S = TypeVar("S", bound=np.generic)
_RESULT = 0x7F


@dataclass(frozen=True, slots=True)
class GroupAnswer:
    """One result per servo, in the order asked."""

    data: Bytes
    """(N, length) the block read; meaningless where not ``valid``."""
    valid: NDArray[np.bool_]
    """(N,) answered in this cycle, with the right CRC and length and without a result error."""
    error: Bytes
    """(N,) error byte of the answer; 0 where there was none."""
    answered: NDArray[np.bool_]
    """(N,) whether a status packet came at all."""
    clean: bool
    """Nothing but the expected bytes was on the line."""

    @property
    def complete(self) -> bool:
        """Whether all have answered."""
        return int(np.count_nonzero(self.answered)) == len(self.answered)


class GroupQuestion:
    """One sync read of ``length`` bytes at ``address`` from ``ids``, fast or plain."""

    def __init__(self, ids: Sequence[int], address: int, length: int, *, fast: bool) -> None:
        params = address.to_bytes(2, "little") + length.to_bytes(2, "little") + bytes(ids)
        kind = Instruction.FAST_SYNC_READ if fast else Instruction.SYNC_READ
        self.request = encode_instruction(InstructionPacket(BROADCAST_ID, kind, params))
        self.fast = fast
        self.frame_bytes = length + (4 if fast else 11)
        """Of one servo's share of the answer, without stuffing."""
        self.ids = tuple(ids)
        self.length = length
        """Of the block asked for."""
        self._index = {servo_id: k for k, servo_id in enumerate(ids)}
        count = len(self.ids)
        share = (count * self.frame_bytes + 1).to_bytes(2, "little")
        self._fast_head = HEADER + bytes([BROADCAST_ID]) + share + bytes([STATUS])
        heads = b"".join(
            HEADER + bytes([servo_id]) + (length + 4).to_bytes(2, "little") + bytes([STATUS])
            for servo_id in ids
        )
        self._heads = np.frombuffer(heads, np.uint8).reshape(count, 8)
        self._id_bytes = bytes(ids)
        self._all_there = _constant(np.ones(count, np.bool_))
        self._no_error = _constant(np.zeros(count, np.uint8))
        self.answer_bytes = (len(self._fast_head) if fast else 0) + count * self.frame_bytes
        """Length of the whole answer when nothing is stuffed."""

    def parse(self, raw: bytes) -> GroupAnswer:
        """Find each servo's result in all that came between the question and its deadline."""
        answer = self._parse_fast(raw) if self.fast else self._parse_plain(raw)
        if answer is not None:
            return answer
        return self._salvage_fast(raw) if self.fast else self._salvage_plain(raw)

    def missing_bytes(self, raw: bytes) -> int:
        """How many bytes more would complete plain answers that stuffing made longer; 0 if none."""
        if self.fast:
            return 0
        reader = PacketReader()
        seen = {p.servo_id for p in reader.feed(raw)}
        missing = sum(servo_id not in seen for servo_id in self.ids)
        return max(1, missing * self.frame_bytes - reader.pending) if missing else 0

    def _parse_fast(self, raw: bytes) -> GroupAnswer | None:
        if len(raw) != self.answer_bytes or not raw.startswith(self._fast_head):
            return None
        if raw[len(self._fast_head) + 1 :: self.frame_bytes] != self._id_bytes:
            return None
        if crc16_long(raw[:-2]) != raw[-2] | raw[-1] << 8:
            return None
        body = np.frombuffer(raw, np.uint8, offset=len(self._fast_head))
        rows = body.reshape(-1, self.frame_bytes)
        return self._all(rows[:, 2:-2], rows[:, 0])

    def _parse_plain(self, raw: bytes) -> GroupAnswer | None:
        # FF FF FD anywhere but in the headers: stuffed data, or a CRC that looks so; the slow way
        if len(raw) != self.answer_bytes or raw.count(HEADER[:3]) != len(self.ids):
            return None
        rows = np.frombuffer(raw, np.uint8).reshape(-1, self.frame_bytes)
        if not np.array_equal(rows[:, :8], self._heads):
            return None
        crc = rows[:, -2] | rows[:, -1].astype(np.uint16) << 8
        if not np.array_equal(crc16_rows(rows[:, :-2]), crc):
            return None
        return self._all(rows[:, 9:-2], rows[:, 8])

    def _all(self, data: Bytes, error: Bytes) -> GroupAnswer:
        there = self._all_there
        if not np.count_nonzero(error):
            return GroupAnswer(data, there, self._no_error, there, clean=True)
        return GroupAnswer(data, (error & _RESULT) == 0, error, there, clean=True)

    def _salvage_plain(self, raw: bytes) -> GroupAnswer:
        reader = PacketReader()
        packets = reader.feed(raw)
        strange = reader.dropped_bytes + reader.pending
        found: dict[int, StatusPacket] = {}
        twice: set[int] = set()
        for packet in packets:
            if not isinstance(packet, StatusPacket) or packet.servo_id not in self._index:
                strange += 1
            elif len(packet.params) not in (self.length, 0):
                strange += 1  # the answer to another question: an older one
            elif packet.servo_id in found:
                twice.add(packet.servo_id)
            else:
                found[packet.servo_id] = packet
        for servo_id in twice:
            del found[servo_id]  # which of the two is new cannot be known
        return self._partial(found, clean=not strange and not twice)

    def _salvage_fast(self, raw: bytes) -> GroupAnswer:
        """Shares in front of the first damage, each proved by its CRC of everything so far."""
        found: dict[int, StatusPacket] = {}
        start = raw.find(self._fast_head)
        if start < 0:
            return self._partial(found, clean=not raw)
        at = start + len(self._fast_head)
        crc = crc16(raw[start:at])
        for servo_id in self.ids:
            share = raw[at : at + self.frame_bytes]
            if len(share) < self.frame_bytes or share[1] != servo_id:
                break
            crc = crc16(share[:-2], crc)
            if crc != share[-2] | share[-1] << 8:
                break
            found[servo_id] = StatusPacket(servo_id, share[0], share[2:-2])
            crc = crc16(share[-2:], crc)
            at += self.frame_bytes
        return self._partial(found, clean=start == 0 and at == len(raw))

    def _partial(self, found: dict[int, StatusPacket], *, clean: bool) -> GroupAnswer:
        count = len(self.ids)
        data = np.zeros((count, self.length), np.uint8)
        valid, answered = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
        error = np.zeros(count, np.uint8)
        for servo_id, packet in found.items():
            k = self._index[servo_id]
            answered[k], error[k] = True, packet.error
            # an error status may come without data: an answer, but no value
            if packet.result == 0 and len(packet.params) == self.length:
                data[k] = np.frombuffer(packet.params, np.uint8)
                valid[k] = True
        return GroupAnswer(data, valid, error, answered, clean)


def _constant(array: NDArray[S]) -> NDArray[S]:
    array.setflags(write=False)
    return array
