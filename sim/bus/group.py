"""The two packets of a control cycle for all servos at once: a slice and one CRC pass.

Same bytes as ``sim.bus.service`` gives servo by servo (a test holds them together), at a cost that
hardly grows with the number of servos. What is not plain, such as stuffing, a missing ID or a
silent servo, goes the general way.
"""

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import TABLE
from drivers.protocol.packet import HEADER, Instruction
from sim.bus.group_read import FastRead, GroupRead, PlainRead
from sim.bus.kernel import crc_of
from sim.bus.service import RETURN_DELAY_UNIT_S, Answer, Service

_PREFIX = HEADER + b"\xfe"
_GOALS = b"\x74\x00\x04\x00"
"""Address 116 and length 4, as a sync write begins."""


class GroupPath:
    """Vectorised sync write of goal positions and (fast) sync read of any block."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._firmware = service.firmware
        self._bank = service.bank
        self._status_address = self._bank.register("Hardware Error Status").address
        self._version = -1
        self._reads: dict[bytes, GroupRead] = {}
        self._goals: tuple[bytes, bytes, NDArray[np.intp]] | None = None

    def execute(self, raw: bytes, now_s: float, whole: bool) -> list[Answer] | None:
        """Carry out ``raw`` if it is plain, else return None and leave all as it was.

        ``whole`` joins packets that follow each other without a gap into one piece.
        """
        if self._version != self._service.version:
            self._version = self._service.version
            self._reads.clear()
            self._goals = None
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
            self._firmware.refresh(read.address, read.length)
        return read.answers(self._bank.table, whole)

    def _write_goals(self, raw: bytes, now_s: float) -> list[Answer] | None:
        head, ids = raw[:12], raw[12:-2:5]
        known = self._goals
        if known is None or known[0] != head or known[1] != ids:
            rows = self._service.roll.rows[np.frombuffer(ids, np.uint8)]
            if (len(raw) - 14) % 5 or (rows < 0).any() or len(np.unique(rows)) != len(rows):
                return None
            known = self._goals = (head, ids, rows)
        if not _intact(raw):
            return None
        self._firmware.heard(now_s)
        self._firmware.write_goals(known[2], np.frombuffer(raw, np.uint8), 12)
        return []

    def _plan(self, raw: bytes) -> GroupRead | None:
        if raw[7] not in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ) or not _intact(raw):
            return None
        address, length = int.from_bytes(raw[8:10], "little"), int.from_bytes(raw[10:12], "little")
        ids = np.frombuffer(raw, np.uint8, len(raw) - 14, 12)
        rows = self._service.roll.rows[ids]
        if (rows < 0).any() or not self._bank.readable(address, length):
            return None
        if (self._bank["Status Return Level"][rows] < 1).any():
            return None
        delays_s = tuple(
            float(d) * RETURN_DELAY_UNIT_S for d in self._bank["Return Delay Time"][rows]
        )
        fast = raw[7] == Instruction.FAST_SYNC_READ
        kind = FastRead if fast else PlainRead
        return kind(address, length, ids, rows, self._status_address, delays_s)


def _intact(raw: bytes) -> bool:
    return (
        raw[5] | raw[6] << 8 == len(raw) - 7
        and raw.find(HEADER[:3], 8, -2) < 0
        and crc_of(np.frombuffer(raw, np.uint8), 0, len(raw) - 2, 0, TABLE)
        == raw[-2] | raw[-1] << 8
    )
