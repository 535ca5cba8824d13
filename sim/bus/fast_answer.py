"""The joint answer of fast sync and fast bulk reads.

One status packet from the broadcast ID that the servos write one after the other: each adds error,
ID, data, and the CRC of *everything* on the wire so far, earlier CRCs included. It is not stuffed.
(e-manual, Protocol 2.0, Fast Sync Read; that reading reproduces the worked packets of ROBOTIS.)
"""

from collections.abc import Iterable

from drivers.protocol.crc import crc16

HEADER = b"\xff\xff\xfd\x00\xfe"
STATUS = 0x55


def fast_head(parts_bytes: int) -> bytes:
    """Header, length and instruction byte for ``parts_bytes`` of parts, their CRCs included."""
    return HEADER + (parts_bytes + 1).to_bytes(2, "little") + bytes((STATUS,))


def encode_fast(parts: Iterable[tuple[int, int, bytes]], parts_bytes: int | None = None) -> bytes:
    """Answer of servos with ``parts`` (error, ID, data).

    ``parts_bytes`` is what the header announces where servos are missing at the end.
    """
    bodies = [bytes((error, servo_id)) + data for error, servo_id, data in parts]
    announced = sum(len(body) + 2 for body in bodies) if parts_bytes is None else parts_bytes
    packet = bytearray(fast_head(announced))
    for body in bodies:
        packet += body
        packet += crc16(bytes(packet)).to_bytes(2, "little")
    return bytes(packet)
