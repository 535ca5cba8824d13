"""Feetech's serial protocol (FT-SCS): instructions, alarms and the format of words.

A packet is one of DYNAMIXEL Protocol 1.0 (``drivers.protocol.protocol1``). Words differ: STS and
HLS servos are little-endian, SCS servos big-endian, and a signed word is a magnitude with a sign
bit. The tables of the models state both (``config/servos``).
Source: Feetech, "Servo SCS Communication Protocol", and the memory tables of STS, SCSCL and HLS.
"""

from collections.abc import Mapping
from enum import IntEnum, IntFlag

import numpy as np

from snakewalk.config.arrays import Bytes, Int32s
from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.packet import ALERT, StatusPacket
from snakewalk.drivers.protocol.protocol1 import HEADER, checksum
from snakewalk.drivers.protocol.registers import Alarm

MAX_ID = 0xFD
STATUS_BYTES = 6
"""Status packet without data: header 2, ID, length, error, checksum."""
GROUP_BYTES = 8
"""Sync instruction without entries: header 2, ID, length, instruction, address, data length,
checksum. A read of one servo is as long."""
POSITION_MODE = 0
TORQUE_DAMPING = 2
CALIBRATE_MIDDLE = 128
"""Torque Enable(40)."""


class Phase(IntFlag):
    """Bits of Phase(18) that affect scale and direction (memory tables)."""

    DRIVE = 0x01
    """Direction of the motor, STS and SCS."""
    HLS_DRIVE = 0x04
    """Direction of the motor, HLS."""
    FINE_VELOCITY = 0x04
    """A velocity unit is 0.0146 rev/min, STS; else 0.732."""
    ALL_TURNS = 0x10
    """Positions count turns."""
    SENSOR = 0x80
    """Direction of the positions; without the same change of the motor the servo runs away."""


class FeetechInstruction(IntEnum):
    """Instructions of a host."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    RECOVER = 0x06
    """Restore all parameters but the ID."""
    RESTART = 0x08
    BACK_UP = 0x09
    """Store the parameters that RECOVER restores."""
    RESET = 0x0A
    """Reset the count of turns."""
    CALIBRATE = 0x0B
    """Make the present position the middle, or the given one."""
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83


class FeetechAlarm(IntFlag):
    """Bits of the error byte of a reply, and of the servo status (register 65)."""

    VOLTAGE = 0x01
    ENCODER = 0x02
    OVERHEATING = 0x04
    OVER_CURRENT = 0x08
    OVERLOAD = 0x20


_ALARMS: Mapping[int, int] = {
    FeetechAlarm.VOLTAGE: Alarm.INPUT_VOLTAGE,
    FeetechAlarm.ENCODER: Alarm.MOTOR_ENCODER,
    FeetechAlarm.OVERHEATING: Alarm.OVERHEATING,
    FeetechAlarm.OVER_CURRENT: Alarm.OVER_CURRENT,
    FeetechAlarm.OVERLOAD: Alarm.OVERLOAD,
}
ALARM_BITS = sum(_ALARMS)
"""Bits of the error byte that report an alarm."""


def alarm_of(status: int) -> int:
    """``registers.Alarm`` bits of a servo status."""
    return sum(bit for feetech_bit, bit in _ALARMS.items() if status & feetech_bit)


def shutdown_alarms(facts: ServoModel) -> int:
    """Bits of Shutdown(19), "unload condition", that protect a motor: heat, current and load."""
    bits = FeetechAlarm.OVERHEATING | (FeetechAlarm.OVER_CURRENT if facts.measures_current else 0)
    return int(bits | (FeetechAlarm.OVERLOAD if "overload" in facts.alarms else 0))


def decode_word(data: bytes, row: RegisterRow, facts: ServoModel) -> int:
    """Value of a register's wire bytes."""
    value = int.from_bytes(data[: row.size], facts.byte_order, signed=row.signed)
    if row.sign_bit is None or row.size == 1:
        return value
    magnitude = value & (1 << row.sign_bit) - 1
    return -magnitude if value >> row.sign_bit & 1 else magnitude


def encode_word(value: int, row: RegisterRow, facts: ServoModel, name: str) -> bytes:
    """Wire bytes of a register's value.

    Raises:
        ControlTableError: it does not fit.

    """
    if row.sign_bit is not None:
        if abs(value) >= 1 << row.sign_bit:
            raise ControlTableError(f"{name}: {value} does not fit below bit {row.sign_bit}")
        value = abs(value) | (1 << row.sign_bit if value < 0 else 0)
    try:
        return value.to_bytes(row.size, facts.byte_order, signed=row.signed)
    except OverflowError:
        raise ControlTableError(f"{name}: {value} does not fit in {row.size} byte(s)") from None


def wire_bytes(facts: ServoModel, servos: int, length: int) -> tuple[int, int]:
    """Bytes of the requests and replies of a read of ``length`` bytes per servo."""
    requests = GROUP_BYTES + servos if facts.sync_read else GROUP_BYTES * servos
    return requests, servos * (STATUS_BYTES + length)


class BlockFormat:
    """Converts blocks of registers from the wire to little-endian two's complement."""

    def __init__(self, facts: ServoModel, address: int, length: int) -> None:
        """Collect the registers in the block of ``length`` bytes at ``address``."""
        inside = [
            row
            for row in facts.registers.values()
            if address <= row.address and row.address + row.size <= address + length
        ]
        words = [row for row in inside if row.size == 2]
        self._swapped = [row.address - address for row in words if facts.byte_order == "big"]
        self._signs = [
            (row.address - address, row.sign_bit) for row in words if row.sign_bit is not None
        ]
        status = facts.registers["Hardware Error Status"].address - address
        self._status = status if 0 <= status < length else None

    def convert(self, blocks: Bytes) -> Bytes:
        """Converted copy of blocks (N, length)."""
        out = blocks.copy()
        for offset in self._swapped:
            out[:, offset], out[:, offset + 1] = blocks[:, offset + 1], blocks[:, offset]
        for index, bit in self._signs:
            raw: Int32s = out[:, index].astype(np.int32) | out[:, index + 1].astype(np.int32) << 8
            magnitude = raw & (1 << bit) - 1
            value = np.where(raw >> bit & 1, -magnitude, magnitude)
            out[:, index], out[:, index + 1] = value & 0xFF, value >> 8 & 0xFF
        if self._status is not None:
            column = out[:, self._status]
            column[:] = [alarm_of(int(status)) for status in column]
        return out


class FeetechParser:
    """Cuts a byte stream into status packets; skips and counts other bytes."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.dropped_bytes = 0
        """Bytes so far that belong to no packet."""

    @property
    def pending(self) -> int:
        """Bytes that may begin a packet."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[StatusPacket]:
        """Packets that ``data`` completes; the error byte of an alarm is ``ALERT``."""
        buffer = self._buffer
        packets: list[StatusPacket] = []
        buffer += data
        while True:
            start = buffer.find(HEADER)
            if start < 0:
                start = len(buffer) - buffer.endswith(b"\xff")
            while buffer[start + 2 : start + 3] == b"\xff":
                start += 1  # an ID is never FF: the header begins one byte later
            self.dropped_bytes += start
            del buffer[:start]
            if len(buffer) < 4 or (buffer[3] >= 2 and len(buffer) < 4 + buffer[3]):
                return packets
            end = 4 + buffer[3]
            body = bytes(buffer[2 : end - 1])
            if buffer[3] < 2 or checksum(body) != buffer[end - 1]:
                self.dropped_bytes += 2
                del buffer[:2]
                continue
            alert = ALERT if body[2] & ALARM_BITS else 0
            packets.append(StatusPacket(body[0], alert, body[3:]))
            del buffer[:end]
