"""Answers of many servos to one group read, composed at once from their part of the table."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import TABLE, crc16
from drivers.protocol.packet import HEADER, STATUS
from drivers.protocol.stuffing import stuff
from sim.bus.fast_answer import fast_head
from sim.bus.kernel import compose
from sim.bus.service import Answer

Bytes = NDArray[np.uint8]

MOTION = range(126, 136)
"""Present Current, Velocity and Position: refreshed alone where nothing else is read."""


class GroupRead(ABC):
    """One kind of group read: a template of its answer, and how to fill in the rest.

    ``status`` is the address of Hardware Error Status, which the alert in the error byte follows.
    """

    def __init__(
        self,
        address: int,
        length: int,
        ids: Bytes,
        rows: NDArray[np.intp],
        status: int,
        delays_s: tuple[float, ...],
    ) -> None:
        self.address, self.length = address, length
        self.motion = address in MOTION and address + length <= MOTION.stop
        self._rows = rows
        self._block = np.array([address, length, status])
        self._delays_s = delays_s
        self._gapless = not any(delays_s[1:])
        head, frames, error_at, data_at = self._template(ids, length)
        self._packet = np.frombuffer(head + frames.tobytes(), np.uint8).copy()
        self._share = frames.shape[1]
        self._shape = np.array([len(head), self._share, error_at, data_at])

    def answers(self, table: Bytes, whole: bool) -> list[Answer]:
        """Packets with the table's present bytes."""
        compose(self._packet, self._shape, table, self._rows, self._block, TABLE)
        return self._cut(self._packet.tobytes(), whole)

    @abstractmethod
    def _cut(self, raw: bytes, whole: bool) -> list[Answer]:
        """Cut the answer into the packets that it is."""

    @abstractmethod
    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        """Head; shares (N, bytes); where in them the error byte stands, and where the data."""


class PlainRead(GroupRead):
    """Sync read: one status packet a servo."""

    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        head = HEADER + b"\x00" + (length + 4).to_bytes(2, "little") + bytes((STATUS, 0))
        frames = np.zeros((len(ids), length + 11), np.uint8)
        frames[:, :9] = np.frombuffer(head, np.uint8)
        frames[:, 4] = ids
        return b"", frames, 8, 9

    def _cut(self, raw: bytes, whole: bool) -> list[Answer]:
        size = self._share
        frames = [raw[at : at + size] for at in range(0, len(raw), size)]
        if raw.count(HEADER[:3]) > len(frames):  # some data look like a header
            frames = [self._stuffed(frame) for frame in frames]
        elif whole and self._gapless:
            return [Answer(self._delays_s[0], raw)]
        return [Answer(*each) for each in zip(self._delays_s, frames, strict=True)]

    @staticmethod
    def _stuffed(frame: bytes) -> bytes:
        payload = stuff(frame[8:-2])
        body = frame[:5] + (len(payload) + 3).to_bytes(2, "little") + bytes((STATUS,)) + payload
        return body + crc16(body).to_bytes(2, "little")


class FastRead(GroupRead):
    """Fast sync read: one packet that all write; each CRC goes over all before, CRCs included."""

    def _template(self, ids: Bytes, length: int) -> tuple[bytes, Bytes, int, int]:
        frames = np.zeros((len(ids), length + 4), np.uint8)
        frames[:, 1] = ids
        return fast_head(frames.size), frames, 0, 2

    def _cut(self, raw: bytes, whole: bool) -> list[Answer]:
        return [Answer(self._delays_s[0], raw)]
