"""How the servos of a bus answer one instruction packet, any of them, one servo at a time.

The two packets of a control cycle have a vectorised way in ``sim.bus.group`` with the same result.
"""

from dataclasses import dataclass

import numpy as np

from drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_status,
)
from sim.bus.fast_answer import encode_fast
from sim.bus.firmware import Firmware
from sim.bus.orders import Orders, word

RETURN_DELAY_UNIT_S = 2e-6
"""Return Delay Time(9), e-manual."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Bytes on the wire after a silence."""

    delay_s: float
    data: bytes


class Service:
    """Executes instruction packets on a firmware and composes the answers."""

    def __init__(self, firmware: Firmware, baud: int) -> None:
        self.firmware = firmware
        self.bank = firmware.bank
        self.baud = baud
        self.version = 0
        """Grows whenever registers were written, so that others know what to look up again."""
        self.retune()
        self._orders = Orders(firmware)

    def retune(self) -> None:
        """Look up again who listens at the line's baud rate, under which ID."""
        self.rows = self.bank.rows_at(self.baud)
        self.version += 1

    def delay_s(self, row: int) -> float:
        """Silence that a servo keeps before it answers."""
        return int(self.bank["Return Delay Time"][row]) * RETURN_DELAY_UNIT_S

    def execute(self, packet: InstructionPacket, now_s: float) -> list[Answer]:
        """Carry out a valid packet that ended at ``now_s``; the firmware is already there."""
        self.firmware.heard(now_s)
        code, params = packet.instruction, packet.params
        if code == Instruction.PING:
            return self._ping(packet.servo_id)
        if code in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ):
            return self._sync_read(params, fast=code == Instruction.FAST_SYNC_READ)
        if code in (Instruction.BULK_READ, Instruction.FAST_BULK_READ):
            return self._bulk_read(params, fast=code == Instruction.FAST_BULK_READ)
        if code == Instruction.SYNC_WRITE:
            return self._sync_write(params)
        if code == Instruction.BULK_WRITE:
            return self._bulk_write(params)
        if packet.servo_id == BROADCAST_ID:
            for row in np.unique(self.rows[self.rows >= 0]):
                self._one(int(row), code, params)
            return []
        row = int(self.rows[packet.servo_id])
        if row < 0:
            return []
        if code == Instruction.READ:
            return self._read(row, packet.servo_id, params)
        level, delay_s = int(self.bank["Status Return Level"][row]), self.delay_s(row)
        error = self._one(row, code, params)
        if level < 2:
            return []
        return [Answer(delay_s, self._status(row, packet.servo_id, error, b""))]

    def _status(self, row: int, servo_id: int, error: int, data: bytes) -> bytes:
        return encode_status(StatusPacket(servo_id, error | int(self.bank.alert(row)), data))

    def _ping(self, servo_id: int) -> list[Answer]:
        ids = range(253) if servo_id == BROADCAST_ID else (servo_id,)
        answers = []
        for each in ids:
            row = int(self.rows[each])
            if row >= 0:
                model, firmware = self.bank["Model Number"][row], self.bank["Firmware Version"][row]
                data = int(model).to_bytes(2, "little") + bytes((int(firmware),))
                answers.append(Answer(self.delay_s(row), self._status(row, each, 0, data)))
        return answers

    def _block(self, row: int, address: int, length: int) -> tuple[int, bytes]:
        if not self.bank.readable(address, length):
            return ResultError.ACCESS, b""
        return 0, self.bank.table[row, address : address + length].tobytes()

    def _read(self, row: int, servo_id: int, params: bytes) -> list[Answer]:
        if self.bank["Status Return Level"][row] < 1:
            return []
        self.firmware.refresh()
        error, data = ResultError.DATA_LENGTH.value, b""
        if len(params) == 4:
            error, data = self._block(row, word(params, 0), word(params, 2))
        return [Answer(self.delay_s(row), self._status(row, servo_id, error, data))]

    def _sync_read(self, params: bytes, *, fast: bool) -> list[Answer]:
        asked = [(each, word(params, 0), word(params, 2)) for each in params[4:]]
        return self._group_read(asked, fast)

    def _bulk_read(self, params: bytes, *, fast: bool) -> list[Answer]:
        asked = [
            (params[at], word(params, at + 1), word(params, at + 3))
            for at in range(0, len(params) - 4, 5)
        ]
        return self._group_read(asked, fast)

    def _group_read(self, asked: list[tuple[int, int, int]], fast: bool) -> list[Answer]:
        """Servos answer in the order asked; each waits for the one before.

        So after one that is silent, the rest is silent too (ROBOTIS on the SDK's issue tracker).
        """
        self.firmware.refresh()
        answers: list[Answer] = []
        parts: list[tuple[int, int, bytes]] = []
        for servo_id, address, length in asked:
            row = int(self.rows[servo_id])
            if row < 0 or self.bank["Status Return Level"][row] < 1:
                break
            error, data = self._block(row, address, length)
            if fast:
                shown = error | int(self.bank.alert(row))
                parts.append((shown, servo_id, data.ljust(length, b"\0")))
            else:
                status = self._status(row, servo_id, error, data)
                answers.append(Answer(self.delay_s(row), status))
        if parts:
            first = int(self.rows[parts[0][1]])
            whole = sum(length + 4 for _, _, length in asked)
            answers.append(Answer(self.delay_s(first), encode_fast(parts, whole)))
        return answers

    def _sync_write(self, params: bytes) -> list[Answer]:
        address, length = word(params, 0), word(params, 2)
        for at in range(4, len(params) - length, length + 1):
            row = int(self.rows[params[at]])
            if row >= 0:
                self.bank.write(row, address, params[at + 1 : at + 1 + length])
        self._written()
        return []

    def _bulk_write(self, params: bytes) -> list[Answer]:
        at = 0
        while at + 5 <= len(params):
            row, address, length = (
                int(self.rows[params[at]]),
                word(params, at + 1),
                word(params, at + 3),
            )
            data = params[at + 5 : at + 5 + length]
            if row >= 0 and len(data) == length:
                self.bank.write(row, address, data)
            at += 5 + length
        self._written()
        return []

    def _one(self, row: int, code: int, params: bytes) -> int:
        error = self._orders.carry_out(row, code, params)
        self._written()
        return int(error)

    def _written(self) -> None:
        self.firmware.changed()
        self.retune()
