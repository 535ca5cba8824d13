"""Group fast path: the two packets of a control cycle for all servos at once.

A slice of the control tables and one CRC pass give the bytes of ``sim.line.instruction_handler``.
That handles all special cases (stuffing, a missing ID, a silent servo).
"""

from abc import ABC, abstractmethod

import numpy as np

from snakewalk.config.arrays import Bytes, Indices
from snakewalk.drivers.bus.group_read import GroupReadRequest
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.frames import IRREGULAR
from snakewalk.drivers.protocol.packet import HEADER, STATUS, Instruction, fast_head, stuff
from snakewalk.drivers.protocol.registers import RETURN_DELAY_UNIT_S
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.instruction_handler import InstructionHandler
from snakewalk.sim.servo.servo_loops import answer, fill_replies, is_intact

MOTION = range(126, 136)
"""Present Current, Velocity and Position: refreshed alone where nothing else is read."""


class GroupRead(ABC):
    """One kind of group read: a template of its reply, and how to fill it.

    ``status`` is the address of Hardware Error Status, which sets the alert bit.
    """

    def __init__(
        self,
        address: int,
        length: int,
        ids: Bytes,
        rows: Indices,
        status: int,
        delays_s: tuple[float, ...],
    ) -> None:
        self.address = address
        self.length = length
        self.motion = address in MOTION and address + length <= MOTION.stop
        self.delay_s = delays_s[0]
        """Time until the first servo replies."""
        self._rows = rows
        self._block = np.array([address, length, status])
        self._delays_s = delays_s
        self._gapless = not any(delays_s[1:])
        head, frames, error_at, data_at = self._template(ids, length)
        self._packet = np.frombuffer(head + frames.tobytes(), np.uint8).copy()
        self._share = frames.shape[1]
        self._shape = np.array([len(head), self._share, error_at, data_at])

    def replies(self, table: Bytes, gapless: bool) -> list[Reply]:
        """Replies with the table's present bytes."""
        fill_replies(self._packet, self._shape, table, self._rows, self._block)
        return self._cut(self._packet.tobytes(), gapless)

    def decoded(self, table: Bytes, request: GroupReadRequest, data: Bytes, error: Bytes) -> int:
        """Return the result of ``drivers.protocol.frames`` for these replies.

        Fills ``data`` (N, length) and ``error`` (N,), unless the replies are irregular.
        """
        if not self._gapless:
            return IRREGULAR
        replies = self._packet, self._shape, table, self._rows, self._block
        return int(answer(*replies, request.heads, request.id_bytes, data, error))

    @abstractmethod
    def _cut(self, raw: bytes, gapless: bool) -> list[Reply]: ...

    @abstractmethod
    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        """Head; shares (N, bytes); offsets of error byte and data in a share."""


class PlainRead(GroupRead):
    """Sync read: one status packet per servo."""

    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        head = HEADER + b"\x00" + (length + 4).to_bytes(2, "little") + bytes((STATUS, 0))
        frames = np.zeros((len(ids), length + 11), np.uint8)
        frames[:, :9] = np.frombuffer(head, np.uint8)
        frames[:, 4] = ids
        return b"", frames, 8, 9

    def _cut(self, raw: bytes, gapless: bool) -> list[Reply]:
        size = self._share
        frames = [raw[start : start + size] for start in range(0, len(raw), size)]
        if raw.count(HEADER[:3]) > len(frames):  # some data look like a header
            frames = [self._stuffed_frame(frame) for frame in frames]
        elif gapless and self._gapless:
            return [Reply(self._delays_s[0], raw)]
        return [Reply(*reply_facts) for reply_facts in zip(self._delays_s, frames, strict=True)]

    @staticmethod
    def _stuffed_frame(frame: bytes) -> bytes:
        payload = stuff(frame[8:-2])
        body = frame[:5] + (len(payload) + 3).to_bytes(2, "little") + bytes((STATUS,)) + payload
        return body + crc16(body).to_bytes(2, "little")


class FastRead(GroupRead):
    """Fast sync read: one common packet; each CRC covers all bytes before it."""

    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        frames = np.zeros((len(ids), length + 4), np.uint8)
        frames[:, 1] = ids
        return fast_head(frames.size), frames, 0, 2

    def _cut(self, raw: bytes, gapless: bool) -> list[Reply]:
        return [Reply(self._delays_s[0], raw)]


_GROUP_READS = (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ)
_PREFIX = HEADER + b"\xfe"
_GOALS = bytes((Instruction.SYNC_WRITE, 116, 0, 4, 0))
"""Code, address and length of a sync write of goals."""
_LEAST_BYTES = 15
"""A group instruction of one servo without data."""


class GroupFastPath:
    """Vectorised sync write of goal positions and (fast) sync read of any block."""

    def __init__(self, handler: InstructionHandler) -> None:
        self._handler = handler
        self._firmware = handler.firmware
        self._bank = handler.bank
        self._status_address = self._bank.register("Hardware Error Status").address
        self._version = -1
        self._reads: dict[bytes, GroupRead] = {}
        self._goals: tuple[bytes, bytes, Indices] | None = None

    def execute(self, raw: bytes, now_s: float, gapless: bool) -> list[Reply] | None:
        """Execute ``raw`` if it is plain, else return None and change nothing.

        ``gapless`` joins packets without gaps.
        """
        if raw[7:12] == _GOALS:
            return self._write_goals(raw, now_s)
        read = self.read_of(raw)
        if read is None:
            return None
        self.measure(read, now_s)
        return read.replies(self._bank.table, gapless)

    def read_of(self, raw: bytes) -> GroupRead | None:
        """The plain group read in ``raw``, or None."""
        self._forget_changed_values()
        read = self._reads.get(raw)
        if read is None:
            read = self._plan(raw)
            if read is not None:
                self._reads[raw] = read
        return read

    def _forget_changed_values(self) -> None:
        if self._version != self._handler.version:
            self._version = self._handler.version
            self._reads.clear()
            self._goals = None

    def measure(self, read: GroupRead, now_s: float) -> None:
        """Update the tables for ``read``."""
        self._firmware.on_instruction(now_s)
        if read.motion:
            self._firmware.refresh_motion()
        else:
            self._firmware.refresh(read.address, read.length)

    def _write_goals(self, raw: bytes, now_s: float) -> list[Reply] | None:
        self._forget_changed_values()
        head = raw[:12]
        ids = raw[12:-2:5]
        goals = self._goals
        if goals is None or goals[0] != head or goals[1] != ids:
            if len(raw) < _LEAST_BYTES or raw[:5] != _PREFIX:
                return None
            rows = self._handler.directory.rows[np.frombuffer(ids, np.uint8)]
            if (len(raw) - 14) % 5 or (rows < 0).any() or len(np.unique(rows)) != len(rows):
                return None
            if self._handler.directory.deaf[rows].any():
                return None
            goals = self._goals = (head, ids, rows)
        packet = np.frombuffer(raw, np.uint8)
        if not is_intact(packet):
            return None
        self._firmware.on_instruction(now_s)
        self._firmware.write_goals(goals[2], packet, 12)
        return []

    def _plan(self, raw: bytes) -> GroupRead | None:
        if len(raw) < _LEAST_BYTES or raw[:5] != _PREFIX or raw[7] not in _GROUP_READS:
            return None
        if not is_intact(np.frombuffer(raw, np.uint8)):
            return None
        address = int.from_bytes(raw[8:10], "little")
        length = int.from_bytes(raw[10:12], "little")
        ids = np.frombuffer(raw, np.uint8, len(raw) - 14, 12)
        rows = self._handler.directory.rows[ids]
        if (rows < 0).any() or not self._bank.readable(rows, address, length):
            return None
        if (self._bank["Status Return Level"][rows] < 1).any():
            return None
        if self._bank.false_alert[rows].any():
            return None
        delays_s = tuple(
            float(d) * RETURN_DELAY_UNIT_S for d in self._bank["Return Delay Time"][rows]
        )
        fast = raw[7] == Instruction.FAST_SYNC_READ
        kind = FastRead if fast else PlainRead
        return kind(address, length, ids, rows, self._status_address, delays_s)
