"""The packet parser: a byte stream to packets, despite noise, truncation and false headers."""

from snakewalk.drivers.errors import StuffingError
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    HEADER,
    MAX_ID,
    STATUS,
    InstructionPacket,
    Packet,
    StatusPacket,
    unstuff,
)

_HEADER_BYTES = 7  # header, id and length field, before the counted bytes


class PacketParser:
    """Cuts a byte stream into packets; skips and counts other bytes.

    After a wrong length or CRC the search continues one byte after the header, so a damaged packet
    does not hide the next one. Memory is bounded by the longest packet plus the bytes fed at once.
    """

    def __init__(self, max_length: int = 4096) -> None:
        self.max_length = max_length
        """Largest length field accepted; a larger one is noise."""
        self.crc_errors = 0
        """Complete frames with a wrong CRC."""
        self.stuffing_errors = 0
        """Frames with a right CRC but malformed stuffing."""
        self.dropped_bytes = 0
        """Bytes that belonged to no packet."""
        self._buffer = bytearray()

    @property
    def pending(self) -> int:
        """Bytes of an incomplete packet."""
        return len(self._buffer)

    def reset(self) -> None:
        """Drop a partial packet whose rest will not arrive."""
        self.dropped_bytes += len(self._buffer)
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Packet]:
        """Append bytes; return the packets that they complete, in order."""
        buffer = self._buffer
        buffer += data
        packets: list[Packet] = []
        position = 0
        while True:
            header_start = self._next_header(position)
            self.dropped_bytes += header_start - position
            position = header_start
            if len(buffer) - position < _HEADER_BYTES + 3:
                break
            servo_id = buffer[position + 4]
            length = buffer[position + 5] | buffer[position + 6] << 8
            shortest = 4 if buffer[position + 7] == STATUS else 3
            possible = servo_id <= MAX_ID or servo_id == BROADCAST_ID
            if not possible or not shortest <= length <= self.max_length:
                position = self._skip(position)
                continue
            end = position + _HEADER_BYTES + length
            if end > len(buffer):
                break
            if crc16(buffer[position : end - 2]) != buffer[end - 2] | buffer[end - 1] << 8:
                self.crc_errors += 1
                position = self._skip(position)
                continue
            packet = self._decode(
                servo_id, buffer[position + 7], bytes(buffer[position + 8 : end - 2])
            )
            if packet is not None:
                packets.append(packet)
            else:
                self.stuffing_errors += 1
                self.dropped_bytes += end - position
            position = end
        del buffer[:position]
        return packets

    def _skip(self, position: int) -> int:
        self.dropped_bytes += 1
        return position + 1

    def _next_header(self, position: int) -> int:
        """Index of the next header from ``position``, or of a header cut off at the end."""
        start = self._buffer.find(HEADER, position)
        if start >= 0:
            return start
        for kept in (3, 2, 1):
            if len(self._buffer) - position >= kept and self._buffer.endswith(HEADER[:kept]):
                return len(self._buffer) - kept
        return len(self._buffer)

    @staticmethod
    def _decode(servo_id: int, instruction: int, payload: bytes) -> Packet | None:
        """Packet of a frame with a correct CRC; None if its stuffing is malformed."""
        if servo_id == BROADCAST_ID and instruction == STATUS:
            return StatusPacket(servo_id, payload[0], payload[1:])  # fast reads are not stuffed
        try:
            plain = unstuff(payload)
        except StuffingError:
            return None
        if instruction == STATUS:
            return StatusPacket(servo_id, plain[0], plain[1:])
        return InstructionPacket(servo_id, instruction, plain)
