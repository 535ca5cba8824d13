"""Instructions to one servo: write, register, act, reboot, reset, clear, back up."""

from collections.abc import Callable

import numpy as np

from snakewalk.drivers.protocol.packet import Instruction, ResultError
from snakewalk.sim.servo.firmware import Firmware
from snakewalk.sim.servo.register_rules import GOALS

CLEAR_TURNS = b"\x01DXL\x22"
"""Parameters of Clear, multi-turn position; e-manual."""
CLEAR_ERROR = b"\x02ERCL"
"""Parameters of Clear, error; e-manual."""
STORE = b"\x01CTRL"
RESTORE = b"\x02CTRL"
"""Parameters of Control Table Backup; e-manual."""
RESET_KEEPS = {0xFF: (), 0x01: ("ID",), 0x02: ("ID", "Baud Rate")}
"""Factory Reset option -> registers that stay, e-manual."""


class Instructions:
    """Executes instructions whose reply is only an error number."""

    def __init__(self, firmware: Firmware) -> None:
        self.firmware = firmware
        self.bank = firmware.bank
        goals = [self.bank.register(name) for name in GOALS if name in self.bank]
        self._goals = range(min(g.address for g in goals), max(g.address + g.size for g in goals))
        self._by_code: dict[int, Callable[[int, bytes], int]] = {
            Instruction.ACTION: self._action,
            Instruction.REBOOT: self._reboot,
            Instruction.FACTORY_RESET: self._factory_reset,
            Instruction.CLEAR: self._clear,
            Instruction.CONTROL_TABLE_BACKUP: self._back_up,
        }

    def execute(self, row: int, code: int, params: bytes, *, ram_only: bool = False) -> int:
        """Execute one; return the reply's error number."""
        if code == Instruction.WRITE:
            if len(params) < 3:
                return ResultError.DATA_LENGTH
            return self.write(row, word(params, 0), params[2:], ram_only=ram_only)
        if code == Instruction.REG_WRITE:
            if len(params) < 3:
                return ResultError.DATA_LENGTH
            return self.bank.register_write(row, word(params, 0), params[2:], ram_only=ram_only)
        action = self._by_code.get(code)
        if ram_only and code in (Instruction.FACTORY_RESET, Instruction.CONTROL_TABLE_BACKUP):
            return ResultError.ACCESS
        return int(action(row, params) if action is not None else ResultError.INSTRUCTION)

    def write(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> int:
        """Write; a new goal may enable torque."""
        error = self.bank.write(row, address, data, ram_only=ram_only)
        if not error and address + len(data) > self._goals.start and address < self._goals.stop:
            self.firmware.enable_by_goal(np.array([row]))
        return error

    def _action(self, row: int, params: bytes) -> int:
        if params:
            return ResultError.DATA_LENGTH
        kept = self.bank.take_registered(row)
        return self.write(row, *kept) if kept is not None else ResultError.INSTRUCTION

    def _reboot(self, row: int, params: bytes) -> int:
        self.firmware.reboot(row)
        return ResultError.NONE if not params else ResultError.DATA_LENGTH

    def _factory_reset(self, row: int, params: bytes) -> int:
        keep = RESET_KEEPS.get(params[0]) if len(params) == 1 else None
        if keep is None:
            return ResultError.DATA_RANGE
        self.firmware.reboot(row, factory_keeping=keep)
        return ResultError.NONE

    def _clear(self, row: int, params: bytes) -> int:
        if params == CLEAR_TURNS:
            done = self.firmware.clear_turns(row)
        elif params == CLEAR_ERROR:
            done = self.firmware.clear_error(row)
        else:
            return ResultError.DATA_RANGE
        return ResultError.NONE if done else ResultError.RESULT_FAIL

    def _back_up(self, row: int, params: bytes) -> int:
        if params == STORE:
            return self.bank.back_up(row)
        if params != RESTORE:
            return ResultError.DATA_RANGE
        error = self.bank.restore(row)
        if not error:
            self.firmware.reboot(row)
        return error


def word(params: bytes, offset: int) -> int:
    """Two bytes, little-endian."""
    return int.from_bytes(params[offset : offset + 2], "little")
