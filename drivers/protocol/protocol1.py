"""Protocol 1.0 packets; e-manual, DYNAMIXEL Protocol 1.0.

``FF FF | id | length | instruction or error | parameters | checksum``; the length counts the bytes
after it, the checksum is the complement of the sum from the id.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

HEADER = b"\xff\xff"
BROADCAST_ID = 0xFE
MAX_ID = 0xFD


class Instruction1(IntEnum):
    """Instructions of a host."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    SYNC_WRITE = 0x83
    BULK_READ = 0x92


class Error1(IntEnum):
    """Bits of a status packet's error byte, and of Alarm LED(17) and Shutdown(18)."""

    VOLTAGE = 0x01
    ANGLE_LIMIT = 0x02
    OVERHEATING = 0x04
    RANGE = 0x08
    CHECKSUM = 0x10
    OVERLOAD = 0x20
    INSTRUCTION = 0x40


@dataclass(frozen=True, slots=True)
class Packet1:
    """Host to servo; ``intact`` False: wrong checksum."""

    servo_id: int
    instruction: int
    params: bytes
    intact: bool = True


def checksum(body: bytes) -> int:
    """Complement of the sum of the bytes between header and checksum."""
    return ~sum(body) & 0xFF


def frame(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """An instruction packet; with an error byte as ``code`` a status packet."""
    body = bytes((servo_id, len(params) + 2, code)) + params
    return HEADER + body + bytes((checksum(body),))


class Reader1:
    """Cuts a byte stream into instruction packets; skips noise before a header."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def reset(self) -> None:
        """Drop a partial packet."""
        self._buffer.clear()

    def feed(self, data: bytes) -> Iterator[Packet1]:
        """Packets that ``data`` completes."""
        buffer = self._buffer
        buffer += data
        while True:
            start = buffer.find(HEADER)
            if start < 0:
                del buffer[: max(0, len(buffer) - 1)]
                return
            while start + 2 < len(buffer) and buffer[start + 2] == 0xFF:
                start += 1  # an ID is never FF: the header begins one byte later
            del buffer[:start]
            if len(buffer) < 4 or len(buffer) < 4 + buffer[3]:
                return
            if buffer[3] < 2:
                del buffer[:2]
                continue
            end = 4 + buffer[3]
            body = bytes(buffer[2 : end - 1])
            yield Packet1(body[0], body[2], body[3:], checksum(body) == buffer[end - 1])
            del buffer[:end]
