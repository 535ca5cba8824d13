"""Group reads: one (fast) sync read of many servos, with one result per servo.

A complete reply without stuffing is decoded in one compiled pass (``drivers.protocol.frames``). In
any other reply a result is valid only if it certainly belongs to the request.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.feetech import FeetechParser
from snakewalk.drivers.protocol.frames import FLAWLESS, HEAD, IRREGULAR, read_fast, read_plain
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    HEADER,
    STATUS,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser

S = TypeVar("S", bound=np.generic)
_RESULT = 0x7F


class GroupReadReply(NamedTuple):
    """One result per servo, in the order of the request."""

    data: Bytes
    """(N, length) the block; meaningless where not ``valid``."""
    valid: Bools
    """(N,) replied in this cycle, with the right CRC and length and without a result error."""
    error: Bytes
    """(N,) error byte of the reply; 0 without a reply."""
    answered: Bools
    """(N,) whether a status packet arrived at all."""
    clean: bool
    """Whether only the expected bytes were on the line."""
    whole: bool = False
    """Whether the reply is known to be complete: a regular reply."""
    flawless: bool = False
    """Whether the reply is known to be valid from all servos, and to report no error."""

    @property
    def complete(self) -> bool:
        """Whether all servos have replied."""
        return self.whole or int(np.count_nonzero(self.answered)) == len(self.answered)

    @property
    def valid_count(self) -> int:
        """Number of valid blocks."""
        return len(self.valid) if self.flawless else int(np.count_nonzero(self.valid))


class GroupReadRequest:
    """Sync read of ``length`` bytes at ``address`` from ``ids``, fast or plain."""

    header = HEADER
    """First bytes of each packet of the reply."""
    parser: type[PacketParser | FeetechParser] = PacketParser

    def __init__(self, ids: Sequence[int], address: int, length: int, *, fast: bool) -> None:
        params = address.to_bytes(2, "little") + length.to_bytes(2, "little") + bytes(ids)
        kind = Instruction.FAST_SYNC_READ if fast else Instruction.SYNC_READ
        self.packet = encode_instruction(InstructionPacket(BROADCAST_ID, kind, params))
        self.fast = fast
        self.frame_bytes = length + (4 if fast else 11)
        """Bytes of one servo in the reply, without stuffing."""
        self.ids = tuple(ids)
        self.length = length
        """Bytes of the block that each servo returns."""
        self._index = {servo_id: k for k, servo_id in enumerate(ids)}
        count = len(self.ids)
        share = (count * self.frame_bytes + 1).to_bytes(2, "little")
        self._fast_head = HEADER + bytes([BROADCAST_ID]) + share + bytes([STATUS])
        heads = b"".join(
            HEADER + bytes([servo_id]) + (length + 4).to_bytes(2, "little") + bytes([STATUS])
            for servo_id in ids
        )
        heads = self._fast_head if fast else heads
        self.heads = np.frombuffer(heads, np.uint8).reshape(-1, HEAD).copy()
        """(N, 8) expected heads of the replies; (1, 8) if fast."""
        self.id_bytes = np.array(self.ids, np.uint8)
        """(N,) IDs of the servos as bytes."""
        self._error = np.zeros(count, np.uint8)
        self._all = _constant(np.ones(count, np.bool_))
        no_error = _constant(np.zeros(count, np.uint8))
        self._flawless = GroupReadReply(
            no_error, self._all, no_error, self._all, clean=True, whole=True, flawless=True
        )[1:]
        """Result of a regular reply without errors, besides its data."""
        self.reply_bytes = (len(self._fast_head) if fast else 0) + count * self.frame_bytes
        """Length of the whole reply without stuffing."""

    def parse(self, raw: bytes) -> GroupReadReply:
        """Find each servo's result in the bytes."""
        if len(raw) == self.reply_bytes:
            reply = self._regular(np.frombuffer(raw, np.uint8))
            if reply is not None:
                return reply
        return self._salvage_fast(raw) if self.fast else self._salvage_plain(raw)

    def regular(self, status: int, data: Bytes, error: Bytes) -> GroupReadReply:
        """Regular reply from the frame reader's ``status``; keeps ``data``."""
        if status == FLAWLESS:
            return GroupReadReply(data, *self._flawless)
        error = error.copy()
        valid = (error & _RESULT) == 0
        return GroupReadReply(data, valid, error, self._all, clean=True, whole=True)

    def missing_bytes(self, raw: bytes) -> int:
        """Number of bytes that would complete the replies, or 0.

        They are missing if stuffing made plain replies longer, or an older reply came first.
        """
        if self.fast:
            start = raw.rfind(self._fast_head)
            return HEAD if start < 0 else max(0, start + self.reply_bytes - len(raw))
        reader = self.parser()
        missing = len(self.ids) - len(self._in_turn(reader.feed(raw))[0])
        return max(1, missing * self.frame_bytes - reader.pending) if missing else 0

    def _regular(self, raw: Bytes) -> GroupReadReply | None:
        data = np.empty((len(self.ids), self.length), np.uint8)
        if self.fast:
            status = read_fast(raw, self.heads[0], self.id_bytes, data, self._error)
        else:
            status = read_plain(raw, self.heads, data, self._error)
        if status == IRREGULAR:
            return None
        return self.regular(status, data, self._error)

    def _salvage_plain(self, raw: bytes) -> GroupReadReply:
        reader = PacketParser()
        packets = reader.feed(raw)
        by_id, unexpected = self._in_turn(packets)
        unexpected += reader.dropped_bytes + reader.pending
        return self._partial(by_id, clean=not unexpected)

    def _in_turn(self, packets: Sequence[object]) -> tuple[dict[int, StatusPacket], int]:
        """Replies of this length by servo, and the number of damaged or misplaced packets.

        Servos reply in the order of the request. Packets of every longest run in that order are
        new; earlier packets of the same servo are copies of old ones. Two replies at one place are
        both invalid.
        """
        packets_in_turn = [
            packet
            for before, packet in zip([None, *packets], packets, strict=False)
            if isinstance(packet, StatusPacket)
            and packet.servo_id in self._index
            and len(packet.params) in (self.length, 0)  # else to an older request
            and packet != before  # an immediate copy has the same content
        ]
        turns = [self._index[packet.servo_id] for packet in packets_in_turn]
        before, after = _run_lengths(turns), _run_lengths([-t for t in reversed(turns)])[::-1]
        longest = max(before, default=0)
        ranks = [
            rank if rank + rest == longest + 1 else 0
            for rank, rest in zip(before, after, strict=True)
        ]
        by_id = {
            packet.servo_id: packet
            for k, (packet, rank) in enumerate(zip(packets_in_turn, ranks, strict=True))
            if rank and ranks.count(rank) == 1 and turns[k] not in turns[k + 1 :]
        }
        return by_id, len(packets) - len(by_id)

    def _salvage_fast(self, raw: bytes) -> GroupReadReply:
        """Results before the first damage; a CRC proves each."""
        by_id: dict[int, StatusPacket] = {}
        start = raw.rfind(self._fast_head)  # of two, the first is a repeated older one
        if start < 0:
            return self._partial(by_id, clean=not raw)
        offset = start + len(self._fast_head)
        crc = crc16(raw[start:offset])
        for servo_id in self.ids:
            share = raw[offset : offset + self.frame_bytes]
            if len(share) < self.frame_bytes or share[1] != servo_id:
                break
            crc = crc16(share[:-2], crc)
            if crc != share[-2] | share[-1] << 8:
                break
            by_id[servo_id] = StatusPacket(servo_id, share[0], share[2:-2])
            crc = crc16(share[-2:], crc)
            offset += self.frame_bytes
        return self._partial(by_id, clean=start == 0 and offset == len(raw))

    def _partial(self, by_id: dict[int, StatusPacket], *, clean: bool) -> GroupReadReply:
        count = len(self.ids)
        data = np.zeros((count, self.length), np.uint8)
        valid = np.zeros(count, np.bool_)
        answered = np.zeros(count, np.bool_)
        error = np.zeros(count, np.uint8)
        for servo_id, packet in by_id.items():
            k = self._index[servo_id]
            answered[k], error[k] = True, packet.error
            # an error status may lack data
            if packet.result == 0 and len(packet.params) == self.length:
                data[k] = np.frombuffer(packet.params, np.uint8)
                valid[k] = True
        return GroupReadReply(data, valid, error, answered, clean)


def _run_lengths(values: Sequence[int]) -> list[int]:
    lengths: list[int] = []
    for k, value in enumerate(values):
        lower = [lengths[j] for j in range(k) if values[j] < value]
        lengths.append(1 + max(lower, default=0))
    return lengths


def _constant(array: NDArray[S]) -> NDArray[S]:
    array.setflags(write=False)
    return array
