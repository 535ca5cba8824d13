"""What mutation showed that no test noticed: the edges of packets and of the reader."""

import pytest

from snakewalk.drivers.errors import ProtocolError
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    HEADER,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser

PING = InstructionPacket(1, 1)
PING_RAW = encode_instruction(PING)


def framed(servo_id: int, body: bytes) -> bytes:
    """Any ``body`` behind the length field, with a right CRC."""
    raw = HEADER + bytes([servo_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return raw + crc16(raw).to_bytes(2, "little")


def test_reset_forgets_and_counts() -> None:
    reader = PacketParser()
    reader.feed(PING_RAW[:9])
    assert (reader.pending, reader.dropped_bytes) == (9, 0)
    reader.reset()
    assert (reader.pending, reader.dropped_bytes) == (0, 9)
    assert reader.feed(PING_RAW) == [PING]


@pytest.mark.parametrize("size", [252, 253, 254, 300, 513, 4000])
def test_lengths_of_two_bytes(size: int) -> None:
    packet = InstructionPacket(1, 3, bytes(range(250)) * 17)
    packet = InstructionPacket(1, 3, packet.params[:size])
    assert PacketParser().feed(encode_instruction(packet) + PING_RAW) == [packet, PING]


def test_the_longest_packet_that_is_believed() -> None:
    packet = InstructionPacket(1, 3, bytes(17))
    raw = encode_instruction(packet)
    assert PacketParser(20).feed(raw) == [packet]
    reader = PacketParser(19)
    assert reader.feed(raw + PING_RAW) == [PING]
    assert reader.dropped_bytes == len(raw)


def test_a_status_packet_without_an_error_byte_is_none() -> None:
    assert PacketParser().feed(framed(1, b"\x55") + PING_RAW) == [PING]


def test_a_frame_without_an_instruction_is_none() -> None:
    for servo_id in range(253):
        assert PacketParser().feed(framed(servo_id, b"") + PING_RAW) == [PING]


def test_instructions_whose_crc_begins_like_a_status_packet() -> None:
    raws = [framed(i, bytes((code,))) for i in range(253) for code in range(0x56, 0x80)]
    met = [raw for raw in raws if raw[8] == 0x55]
    assert met
    for raw in met:
        (packet,) = PacketParser().feed(raw)
        assert packet == InstructionPacket(raw[4], raw[7])


@pytest.mark.parametrize(("servo_id", "possible"), [(252, True), (253, False), (255, False)])
def test_ids(servo_id: int, possible: bool) -> None:
    packets = PacketParser().feed(framed(servo_id, b"\x01") + PING_RAW)
    assert packets == ([InstructionPacket(servo_id, 1)] if possible else []) + [PING]


def test_a_frame_with_broken_stuffing_is_counted_as_dropped() -> None:
    broken = framed(1, b"\x03\xff\xff\xfd\x00")
    reader = PacketParser()
    assert reader.feed(b"\x00\x01" + broken + PING_RAW) == [PING]
    assert (reader.stuffing_errors, reader.dropped_bytes) == (1, 2 + len(broken))


@pytest.mark.parametrize("noise", [b"\x00", b"\x00\x01", b"\x00\x01\x02", b"\xff\xfe\x00"])
def test_noise_that_begins_no_header_is_not_kept(noise: bytes) -> None:
    reader = PacketParser()
    reader.feed(noise)
    assert (reader.pending, reader.dropped_bytes) == (0, len(noise))


def test_the_end_of_a_packet_is_not_kept_as_the_beginning_of_a_header() -> None:
    raws = [framed(i, bytes((3, a))) for i in range(253) for a in range(40)]
    met = [raw for raw in raws if raw.endswith(b"\xff")]
    assert met
    for raw in met:
        reader = PacketParser()
        assert len(reader.feed(raw)) == 1
        assert (reader.pending, reader.dropped_bytes) == (0, 0)


def test_a_packet_without_an_alert_has_none() -> None:
    assert not StatusPacket(1, 0).alert
    assert not StatusPacket(1, 0x7F).alert
    assert StatusPacket(1, 0x80).alert


def test_what_is_stuffed() -> None:
    nasty = b"\xff\xff\xfd\x01"
    assert b"\xff\xff\xfd\xfd\x01" in encode_status(StatusPacket(1, 0, nasty))
    assert b"\xff\xff\xfd\xfd\x01" not in encode_status(StatusPacket(BROADCAST_ID, 0, nasty))
    assert nasty in encode_status(StatusPacket(BROADCAST_ID, 0, nasty))


def test_the_length_field_ends_at_65535() -> None:
    assert len(encode_instruction(InstructionPacket(1, 3, bytes(65_532)))) == 65_542
    with pytest.raises(ProtocolError, match="length 65536: the length field ends at 65535"):
        encode_instruction(InstructionPacket(1, 3, bytes(65_533)))
