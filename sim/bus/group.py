"""The two packets of a control cycle for all servos at once: a slice and one CRC pass.

Same bytes as ``sim.bus.service`` gives servo by servo (a test holds them together), at a cost that
hardly grows with the number of servos. What is not plain, such as stuffing, a missing ID or a
silent servo, goes the general way.
"""

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import crc16, crc16_rows
from drivers.protocol.packet import HEADER, STATUS, Instruction
from drivers.protocol.stuffing import stuff
from sim.bus.fast_answer import fast_head
from sim.bus.service import RETURN_DELAY_UNIT_S, Answer, Service

Bytes = NDArray[np.uint8]

_PREFIX = HEADER + b"\xfe"
_GOALS = b"\x74\x00\x04\x00"
"""Address 116 and length 4, as a sync write begins."""
_MOTION = range(126, 136)
"""Present Current, Velocity and Position: refreshed alone where nothing else is read."""


class GroupPath:
    """Vectorised sync write of goal positions and (fast) sync read of any block."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._firmware = service.firmware
        self._bank = service.bank
        self._version = -1
        self._reads: dict[bytes, _Read] = {}
        self._goal_rows: tuple[bytes, NDArray[np.intp] | slice] | None = None

    def execute(self, raw: bytes, now_s: float, whole: bool) -> list[Answer] | None:
        """Carry out ``raw`` if it is plain, else return None and leave all as it was.

        ``whole`` joins packets that follow each other without a gap into one piece.
        """
        if self._version != self._service.version:
            self._version = self._service.version
            self._reads.clear()
            self._goal_rows = None
        read = self._reads.get(raw)
        if read is None:
            if raw[:5] != _PREFIX or len(raw) < 15:
                return None
            if raw[7] == Instruction.SYNC_WRITE and raw[8:12] == _GOALS:
                return self._write_goals(raw, now_s)
            read = self._plan(raw)
            if read is None:
                return None
            self._reads[raw] = read
        self._firmware.heard(now_s)
        if read.motion:
            self._firmware.refresh_motion()
        else:
            self._firmware.refresh()
        return read.answers(self._bank.table, self._bank.alert(read.rows), whole)

    def _write_goals(self, raw: bytes, now_s: float) -> list[Answer] | None:
        values = np.frombuffer(raw, np.uint8, len(raw) - 14, 12)
        if len(values) % 5 or not _intact(raw):
            return None
        block = values.reshape(-1, 5)
        ids = block[:, 0].tobytes()
        if self._goal_rows is None or self._goal_rows[0] != ids:
            rows = self._service.rows[block[:, 0]]
            if (rows < 0).any() or len(np.unique(rows)) != len(rows):
                return None
            self._goal_rows = (ids, _as_slice(rows))
        self._firmware.heard(now_s)
        self._firmware.write_goals(self._goal_rows[1], block[:, 1:].copy().view("<i4")[:, 0])
        return []

    def _plan(self, raw: bytes) -> "_PlainRead | _FastRead | None":
        if raw[7] not in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ) or not _intact(raw):
            return None
        address, length = int.from_bytes(raw[8:10], "little"), int.from_bytes(raw[10:12], "little")
        ids = np.frombuffer(raw, np.uint8, len(raw) - 14, 12)
        rows = self._service.rows[ids]
        if (rows < 0).any() or not self._bank.readable(address, length):
            return None
        if (self._bank["Status Return Level"][rows] < 1).any():
            return None
        delays_s = tuple(
            float(d) * RETURN_DELAY_UNIT_S for d in self._bank["Return Delay Time"][rows]
        )
        fast = raw[7] == Instruction.FAST_SYNC_READ
        kind = _FastRead if fast else _PlainRead
        return kind(address, length, ids, _as_slice(rows), delays_s)


def _intact(raw: bytes) -> bool:
    return (
        int.from_bytes(raw[5:7], "little") == len(raw) - 7
        and HEADER[:3] not in raw[8:-2]
        and crc16(raw[:-2]) == int.from_bytes(raw[-2:], "little")
    )


def _as_slice(rows: NDArray[np.intp]) -> NDArray[np.intp] | slice:
    first = int(rows[0])
    ordered = np.array_equal(rows, np.arange(first, first + len(rows)))
    return slice(first, first + len(rows)) if ordered else rows


class _Read:
    """One kind of group read: the constant bytes of its answer, and how to fill in the rest."""

    def __init__(
        self,
        address: int,
        length: int,
        ids: Bytes,
        rows: NDArray[np.intp] | slice,
        delays_s: tuple[float, ...],
    ) -> None:
        self.rows = rows
        self.motion = address in _MOTION and address + length <= _MOTION.stop
        self._block = slice(address, address + length)
        self._delays_s = delays_s
        self._gapless = not any(delays_s[1:])
        self._frames = self._template(ids, length)

    def answers(self, table: Bytes, alert: Bytes, whole: bool) -> list[Answer]:
        """Packets with the table's present bytes."""
        raise NotImplementedError

    def _template(self, ids: Bytes, length: int) -> Bytes:
        raise NotImplementedError


class _PlainRead(_Read):
    """Sync read: one status packet a servo."""

    def _template(self, ids: Bytes, length: int) -> Bytes:
        head = HEADER + b"\x00" + (length + 4).to_bytes(2, "little") + bytes((STATUS, 0))
        frames = np.zeros((len(ids), length + 11), np.uint8)
        frames[:, :9] = np.frombuffer(head, np.uint8)
        frames[:, 4] = ids
        return frames

    def answers(self, table: Bytes, alert: Bytes, whole: bool) -> list[Answer]:
        frames = self._frames
        frames[:, 8] = alert
        frames[:, 9:-2] = table[self.rows, self._block]
        frames[:, -2:] = crc16_rows(frames[:, :-2]).astype("<u2").view(np.uint8).reshape(-1, 2)
        raw = frames.tobytes()
        if raw.count(HEADER[:3]) > len(frames):  # some data look like a header
            return [
                self._stuffed(row, delay_s)
                for row, delay_s in zip(frames, self._delays_s, strict=True)
            ]
        if whole and self._gapless:
            return [Answer(self._delays_s[0], raw)]
        size = frames.shape[1]
        return [
            Answer(delay_s, raw[at * size : (at + 1) * size])
            for at, delay_s in enumerate(self._delays_s)
        ]

    @staticmethod
    def _stuffed(frame: Bytes, delay_s: float) -> Answer:
        payload = stuff(frame[8:-2].tobytes())
        body = frame[:5].tobytes() + (len(payload) + 3).to_bytes(2, "little") + bytes((STATUS,))
        body += payload
        return Answer(delay_s, body + crc16(body).to_bytes(2, "little"))


class _FastRead(_Read):
    """Fast sync read: one packet that all write; each CRC goes over all before, CRCs included."""

    def _template(self, ids: Bytes, length: int) -> Bytes:
        frames = np.zeros((len(ids), length + 4), np.uint8)
        frames[:, 1] = ids
        self._head = fast_head(frames.size)
        # CRC state s (high, low) after the bytes low, high and the next part p is, by linearity,
        # crc(p) ^ crc(x x 0...0) with x = high ^ low: one table of 256 carries it along.
        zeros = np.zeros((256, length + 4), np.uint8)
        zeros[:, :2] = np.arange(256)[:, None]
        self._carry = [int(c) for c in crc16_rows(zeros)]
        self._first = crc16(self._head + bytes(length + 2))
        return frames

    def answers(self, table: Bytes, alert: Bytes, whole: bool) -> list[Answer]:
        frames = self._frames
        frames[:, 0] = alert
        frames[:, 2:-2] = table[self.rows, self._block]
        state, carry = self._first, self._carry
        states: list[int] = []
        for own in crc16_rows(frames[:, :-2]).tolist():
            state = own ^ (carry[(state >> 8) ^ (state & 0xFF)] if states else state)
            states.append(state)
        frames[:, -2:] = np.array(states, "<u2").view(np.uint8).reshape(-1, 2)
        return [Answer(self._delays_s[0], self._head + frames.tobytes())]
