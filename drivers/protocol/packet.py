"""Protocol 2.0 packets, both directions, shared by host and servo.

``FF FF FD 00 | id | length (2) | instruction | [error] parameters, stuffed | CRC (2)``; the length
counts the bytes after it. Source: e-manual, DYNAMIXEL Protocol 2.0.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from snakewalk.drivers.errors import ProtocolError, StuffingError
from snakewalk.drivers.protocol.crc import crc16

HEADER = b"\xff\xff\xfd\x00"
BITS_PER_BYTE = 10
"""Bits of a byte on the line: start, eight data bits, stop."""
BROADCAST_ID = 0xFE
MAX_ID = 0xFC
STATUS = 0x55
"""Instruction field of a status packet."""
ALERT = 0x80
"""Bit of the error byte: register 70 (Hardware Error Status) is not zero."""


class Instruction(IntEnum):
    """Instructions of the host."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    CONTROL_TABLE_BACKUP = 0x20
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93
    FAST_BULK_READ = 0x9A


class ResultError(IntEnum):
    """Low seven bits of a status packet's error byte."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


@dataclass(frozen=True, slots=True)
class InstructionPacket:
    """Host to servo."""

    servo_id: int
    instruction: int
    """An ``Instruction``; other numbers are kept, so that a servo can refuse them."""
    params: bytes = b""
    """Parameters of the packet without stuffing."""


@dataclass(frozen=True, slots=True)
class StatusPacket:
    """Servo to host; ID 0xFE marks the common reply to a fast read.

    There, ``error`` is the first servo's, and ``params`` has all following bytes except the last
    CRC.
    """

    servo_id: int
    error: int
    params: bytes = b""
    """Parameters of the packet without stuffing."""

    @property
    def result(self) -> int:
        """Error code without the alert bit; a ``ResultError`` by the e-manual."""
        return self.error & ~ALERT

    @property
    def alert(self) -> bool:
        """Whether the servo reports a hardware error (register 70)."""
        return bool(self.error & ALERT)


Packet = InstructionPacket | StatusPacket


def encode_instruction(packet: InstructionPacket) -> bytes:
    """Bytes of an instruction packet, stuffed.

    Raises:
        ProtocolError: invalid ID or length.

    """
    return _frame(packet.servo_id, packet.instruction, stuff(packet.params))


def encode_status(packet: StatusPacket) -> bytes:
    """Bytes of a status packet, stuffed unless it replies to a fast read (ID 0xFE).

    Raises:
        ProtocolError: invalid ID or length.

    """
    payload = bytes([packet.error]) + packet.params
    if packet.servo_id != BROADCAST_ID:
        payload = stuff(payload)
    return _frame(packet.servo_id, STATUS, payload)


def _frame(servo_id: int, instruction: int, payload: bytes) -> bytes:
    if not (0 <= servo_id <= MAX_ID or servo_id == BROADCAST_ID):
        raise ProtocolError(f"id {servo_id}: a bus has 0 to {MAX_ID}, and {BROADCAST_ID} for all")
    length = len(payload) + 3
    if length > 0xFFFF:
        raise ProtocolError(f"packet of length {length}: the length field ends at 65535")
    body = (
        HEADER + bytes([servo_id]) + length.to_bytes(2, "little") + bytes([instruction]) + payload
    )
    return body + crc16(body).to_bytes(2, "little")


_HEADER = b"\xff\xff\xfd"
_STUFFED_HEADER = b"\xff\xff\xfd\xfd"


def stuff(params: bytes) -> bytes:
    """Add ``FD`` after every ``FF FF FD`` in ``params``, all bytes from instruction to CRC."""
    return params.replace(_HEADER, _STUFFED_HEADER)


def unstuff(params: bytes) -> bytes:
    """Exact inverse of ``stuff``.

    Raises:
        StuffingError: ``params`` has a bare ``FF FF FD``.

    """
    plain = params.replace(_STUFFED_HEADER, _HEADER)
    if stuff(plain) != params:
        raise StuffingError("FF FF FD without its stuffed FD in a payload")
    return plain


def fast_head(parts_bytes: int) -> bytes:
    """Header to instruction byte of a fast reply with ``parts_bytes``, CRCs included."""
    head = HEADER + bytes((BROADCAST_ID,))
    return head + (parts_bytes + 1).to_bytes(2, "little") + bytes((STATUS,))


def encode_fast(parts: Iterable[tuple[int, int, bytes]], parts_bytes: int | None = None) -> bytes:
    """Common reply of servos to a fast sync or bulk read, from ``parts`` (error, ID, data).

    The servos write one unstuffed status packet in turn: each adds error, ID, data, and the CRC of
    all bytes so far. ``parts_bytes`` is the announced length if servos at the end are missing.
    """
    bodies = [bytes((error, servo_id)) + data for error, servo_id, data in parts]
    announced = sum(len(body) + 2 for body in bodies) if parts_bytes is None else parts_bytes
    packet = bytearray(fast_head(announced))
    for body in bodies:
        packet += body
        packet += crc16(bytes(packet)).to_bytes(2, "little")
    return bytes(packet)
