"""Answers of many servos to one group read, composed at once from their part of the table."""

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import crc16, crc16_rows
from drivers.protocol.packet import HEADER, STATUS
from drivers.protocol.stuffing import stuff
from sim.bus.fast_answer import fast_head
from sim.bus.service import Answer

Bytes = NDArray[np.uint8]

MOTION = range(126, 136)
"""Present Current, Velocity and Position: refreshed alone where nothing else is read."""


class GroupRead:
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
        self.motion = address in MOTION and address + length <= MOTION.stop
        self._block = slice(address, address + length)
        self._delays_s = delays_s
        self._gapless = not any(delays_s[1:])
        self._frames = self._template(ids, length)

    def answers(self, table: Bytes, alert: Bytes, whole: bool) -> list[Answer]:
        """Packets with the table's present bytes."""
        raise NotImplementedError

    def _template(self, ids: Bytes, length: int) -> Bytes:
        raise NotImplementedError


class PlainRead(GroupRead):
    """Sync read: one status packet a servo."""

    def _template(self, ids: Bytes, length: int) -> Bytes:
        head = HEADER + b"\x00" + (length + 4).to_bytes(2, "little") + bytes((STATUS, 0))
        frames = np.zeros((len(ids), length + 11), np.uint8)
        frames[:, :9] = np.frombuffer(head, np.uint8)
        frames[:, 4] = ids
        return frames

    def answers(self, table: Bytes, alert: Bytes, whole: bool) -> list[Answer]:
        """Packets with the table's present bytes."""
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


class FastRead(GroupRead):
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
        """Packets with the table's present bytes."""
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
