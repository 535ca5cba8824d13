"""The servos' replies to any instruction packet, one servo at a time.

``sim.line.group_fast_path`` gives the same replies in a control cycle.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from snakewalk.drivers.protocol.packet import (
    ALERT,
    BITS_PER_BYTE,
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_fast,
    encode_status,
)
from snakewalk.drivers.protocol.registers import RETURN_DELAY_UNIT_S
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.bus_contention import Reply, bus_contention
from snakewalk.sim.line.id_directory import IdDirectory
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
        kept_names = RESET_KEEPS.get(params[0]) if len(params) == 1 else None
        if kept_names is None:
            return ResultError.DATA_RANGE
        self.firmware.reboot(row, factory_keeping=kept_names)
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


_GROUP_INSTRUCTIONS = (
    Instruction.SYNC_READ,
    Instruction.FAST_SYNC_READ,
    Instruction.SYNC_WRITE,
    Instruction.BULK_READ,
    Instruction.FAST_BULK_READ,
    Instruction.BULK_WRITE,
)
"""Instructions with ID 254 (e-manual, Sync Read, Bulk Read and their like)."""
MAX_LENGTH = 0xFFFF
"""Greatest value of a packet's length field."""


class _Block(NamedTuple):
    """A device's part of the reply to a read."""

    delay_s: float
    error: int
    data: bytes


class InstructionHandler:
    """Executes instruction packets and composes the replies."""

    def __init__(self, firmware: Firmware, baud: int, imu: Imu | None = None) -> None:
        self.firmware = firmware
        self._imu = imu
        self.bank = firmware.bank
        self.baud = baud
        self.directory = IdDirectory(self.bank)
        self.version = 0
        """Increases whenever registers are written, so that cached values expire."""
        self.collisions = 0
        """Replies that were garbled because several servos replied at once."""
        self.refresh_ids()
        self._instructions = Instructions(firmware)

    def refresh_ids(self) -> None:
        """Look up again which servos the line's baud rate reaches, by ID."""
        self.directory.refresh(self.baud, self.firmware.powered)
        self.version += 1

    def delay_s(self, row: int) -> float:
        """Silence before a servo's reply."""
        return int(self.bank["Return Delay Time"][row]) * RETURN_DELAY_UNIT_S

    def execute(self, packet: InstructionPacket, now_s: float) -> list[Reply]:
        """Execute a valid packet that ended at ``now_s``, the time of the firmware."""
        if not self.directory.present() and self._imu is None:
            return []
        self.firmware.on_instruction(now_s)
        code = packet.instruction
        params = packet.params
        servo_id = packet.servo_id
        if code == Instruction.PING:
            return self._ping(servo_id)
        if code in _GROUP_INSTRUCTIONS and servo_id == BROADCAST_ID:
            return self._group(code, params)
        if servo_id == BROADCAST_ID:
            self._broadcast(code, params)
            return []
        if code == Instruction.READ:
            return self._read(servo_id, params)
        return self._respond(self._execute_for_id(servo_id, code, params))

    def _broadcast(self, code: int, params: bytes) -> None:
        if code == Instruction.FACTORY_RESET and params == b"\xff":  # refused since firmware 42
            return
        for row in self.directory.present():
            self._execute_for_row(row, code, params)

    def _execute_for_id(self, servo_id: int, code: int, params: bytes) -> list[Reply]:
        """Execute an instruction for one ID; return the reply of each device that has it."""
        replies = []
        for row in self.directory.primary(servo_id):
            level = int(self.bank["Status Return Level"][row])
            delay_s = self.delay_s(row)
            error = self._execute_for_row(row, code, params)
            if level == 2 and not self.directory.mute[row]:
                replies.append(Reply(delay_s, self._status(row, servo_id, error, b"")))
        for row in self.directory.secondary(servo_id):
            self._execute_for_row(row, code, params, ram_only=True)
        if self._imu_at(servo_id) is not None:  # no register of it is known to be writable
            refused = StatusPacket(servo_id, ResultError.ACCESS, b"")
            replies.append(Reply(0.0, encode_status(refused)))
        return replies

    def _imu_at(self, servo_id: int) -> Imu | None:
        """The IMU, if it has this ID and the line's baud rate."""
        imu = self._imu
        imu_replies = imu is not None and imu.config.id == servo_id and imu.baud == self.baud
        return imu if imu_replies else None

    def _group(self, code: int, params: bytes) -> list[Reply]:
        if code in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ):
            return self._sync_read(params, fast=code == Instruction.FAST_SYNC_READ)
        if code in (Instruction.BULK_READ, Instruction.FAST_BULK_READ):
            return self._bulk_read(params, fast=code == Instruction.FAST_BULK_READ)
        if code == Instruction.SYNC_WRITE:
            return self._sync_write(params)
        return self._bulk_write(params)

    def _respond(self, replies: list[Reply]) -> list[Reply]:
        if not replies:
            return []
        reply, garbled = bus_contention(replies, BITS_PER_BYTE / self.baud)
        self.collisions += garbled
        return [reply]

    def _status(self, row: int, servo_id: int, error: int, data: bytes) -> bytes:
        return encode_status(StatusPacket(servo_id, error | int(self.bank.alert(row)), data))

    def _ping(self, servo_id: int) -> list[Reply]:
        sent = []
        others = () if self._imu is None else (self._imu.config.id,)
        all_ids = sorted({*self.directory.ids(), *others})
        for replying_id in all_ids if servo_id == BROADCAST_ID else (servo_id,):
            replies = []
            imu = self._imu_at(replying_id)
            if imu is not None:
                data = imu.model_number.to_bytes(2, "little") + b"\x01"
                replies.append(Reply(0.0, encode_status(StatusPacket(replying_id, 0, data))))
            for row in self.directory.replying(replying_id):
                model = self.bank["Model Number"][row]
                firmware = self.bank["Firmware Version"][row]
                data = int(model).to_bytes(2, "little") + bytes((int(firmware),))
                replies.append(Reply(self.delay_s(row), self._status(row, replying_id, 0, data)))
            sent += self._respond(replies)
        return sent

    def _block(self, row: int, address: int, length: int) -> tuple[int, bytes]:
        if not self.bank.readable(row, address, length):
            return ResultError.ACCESS, b""
        return 0, self.bank.table[row, address : address + length].tobytes()

    def _blocks(self, servo_id: int, address: int, length: int) -> list[_Block]:
        """Reply of each device with this ID to a read."""
        rows = [
            row
            for row in self.directory.replying(servo_id)
            if self.bank["Status Return Level"][row] >= 1
        ]
        blocks = []
        for row in rows:
            error, data = self._block(row, address, length)
            blocks.append(_Block(self.delay_s(row), error | int(self.bank.alert(row)), data))
        imu = self._imu_at(servo_id)
        if imu is not None:
            shown = imu.block(address, length)
            error = ResultError.ACCESS if shown is None else ResultError.NONE
            blocks.append(_Block(0.0, error, shown or b""))
        return blocks

    def _read(self, servo_id: int, params: bytes) -> list[Reply]:
        address = 0
        length = 0
        if len(params) == 4:
            address = word(params, 0)
            length = word(params, 2)
            self.firmware.refresh(address, length)
        blocks = self._blocks(servo_id, address, length)
        if len(params) != 4:
            wrong = ResultError.DATA_LENGTH
            blocks = [_Block(b.delay_s, b.error & ALERT | wrong, b"") for b in blocks]
        return self._respond([_reply(servo_id, block) for block in blocks])

    def _sync_read(self, params: bytes, *, fast: bool) -> list[Reply]:
        asked = [(param, word(params, 0), word(params, 2)) for param in params[4:]]
        return self._group_read(asked, fast)

    def _bulk_read(self, params: bytes, *, fast: bool) -> list[Reply]:
        asked = [
            (params[start], word(params, start + 1), word(params, start + 3))
            for start in range(0, len(params) - 4, 5)
        ]
        return self._group_read(asked, fast)

    def _group_read(self, asked: list[tuple[int, int, int]], fast: bool) -> list[Reply]:
        """Servos reply in the order of the request; each waits for the one before.

        So those after a silent one stay silent (ROBOTIS on the SDK's issue tracker).
        """
        if fast and sum(length + 4 for _, _, length in asked) + 1 > MAX_LENGTH:
            return []  # no length field could announce the common reply
        if any(self.directory.replying(servo_id) for servo_id, _, _ in asked):
            self.firmware.refresh()
        sent: list[Reply] = []
        parts: list[tuple[int, int, bytes]] = []
        first_s = 0.0
        garbled = False
        for servo_id, address, length in asked:
            blocks = self._blocks(servo_id, address, length)
            if not blocks:
                break
            if fast:
                first_s = first_s if parts else min(block.delay_s for block in blocks)
                shares = [(b.error, servo_id, b.data.ljust(length, b"\0")) for b in blocks]
                garbled |= any(part != shares[0] for part in shares)
                parts.append(shares[0])
            else:
                sent += self._respond([_reply(servo_id, block) for block in blocks])
        if parts:
            total = sum(length + 4 for _, _, length in asked)
            data = encode_fast(parts, total)
            self.collisions += garbled
            sent.append(Reply(first_s, data[:-2] + b"\0\0" if garbled else data))
        return sent

    def _sync_write(self, params: bytes) -> list[Reply]:
        address = word(params, 0)
        length = word(params, 2)
        for start in range(4, len(params) - length, length + 1):
            self._write(
                params[start], address, params[start + 1 : start + 1 + length], by_sync=True
            )
        self._written()
        return []

    def _bulk_write(self, params: bytes) -> list[Reply]:
        start = 0
        while start + 5 <= len(params):
            length = word(params, start + 3)
            data = params[start + 5 : start + 5 + length]
            if len(data) == length:
                self._write(params[start], word(params, start + 1), data)
            start += 5 + length
        self._written()
        return []

    def _write(self, servo_id: int, address: int, data: bytes, *, by_sync: bool = False) -> None:
        deaf = self.directory.deaf & by_sync
        for row in self.directory.primary(servo_id):
            if not deaf[row]:
                self._instructions.write(row, address, data)
        for row in self.directory.secondary(servo_id):
            if not deaf[row]:
                self._instructions.write(row, address, data, ram_only=True)

    def _execute_for_row(
        self, row: int, code: int, params: bytes, *, ram_only: bool = False
    ) -> int:
        error = self._instructions.execute(row, code, params, ram_only=ram_only)
        self._written()
        return int(error)

    def _written(self) -> None:
        self.firmware.apply_registers()
        self.refresh_ids()


def _reply(servo_id: int, block: _Block) -> Reply:
    return Reply(block.delay_s, encode_status(StatusPacket(servo_id, block.error, block.data)))
