"""What one servo is told to do: write, register, act, reboot, reset, clear."""

from collections.abc import Callable

from drivers.protocol.packet import Instruction, ResultError
from sim.bus.firmware import Firmware

CLEAR_TURNS = bytes((0x01, 0x44, 0x58, 0x4C, 0x22))
"""Parameters of the Clear instruction, e-manual."""
RESET_KEEPS = {0xFF: (), 0x01: ("ID",), 0x02: ("ID", "Baud Rate")}
"""Factory Reset option -> registers that stay, e-manual."""


class Orders:
    """Instructions to a single servo that answer with an error number and nothing else."""

    def __init__(self, firmware: Firmware) -> None:
        self.firmware = firmware
        self.bank = firmware.bank
        self._work: dict[int, Callable[[int, bytes], int]] = {
            Instruction.WRITE: self._write,
            Instruction.REG_WRITE: self._register_write,
            Instruction.ACTION: self._action,
            Instruction.REBOOT: self._reboot,
            Instruction.FACTORY_RESET: self._factory_reset,
            Instruction.CLEAR: self._clear,
        }

    def carry_out(self, row: int, code: int, params: bytes) -> int:
        """Error number of the answer; unknown instructions are an instruction error."""
        work = self._work.get(code)
        return int(work(row, params) if work is not None else ResultError.INSTRUCTION)

    def _write(self, row: int, params: bytes) -> int:
        if len(params) < 3:
            return ResultError.DATA_LENGTH
        return self.bank.write(row, word(params, 0), params[2:])

    def _register_write(self, row: int, params: bytes) -> int:
        if len(params) < 3:
            return ResultError.DATA_LENGTH
        return self.bank.register_write(row, word(params, 0), params[2:])

    def _action(self, row: int, params: bytes) -> int:
        return self.bank.action(row) if not params else ResultError.DATA_LENGTH

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
        if params != CLEAR_TURNS:
            return ResultError.DATA_RANGE
        return ResultError.NONE if self.firmware.clear_turns(row) else ResultError.RESULT_FAIL


def word(params: bytes, at: int) -> int:
    """Two bytes, little-endian."""
    return int.from_bytes(params[at : at + 2], "little")
