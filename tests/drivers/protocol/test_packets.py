"""Packets against the e-manual's worked examples and against the SDK's builder."""

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.drivers.errors import ProtocolError
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser

Do = Instruction
MANUAL = [  # e-manual, DYNAMIXEL Protocol 2.0, Instruction Details, XM430-W210
    (InstructionPacket(1, Do.PING), "FF FF FD 00 01 03 00 01 19 4E"),
    (StatusPacket(1, 0, b"\x06\x04\x26"), "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    (InstructionPacket(BROADCAST_ID, Do.PING), "FF FF FD 00 FE 03 00 01 31 42"),
    (StatusPacket(2, 0, b"\x06\x04\x26"), "FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D"),
    (InstructionPacket(1, Do.READ, b"\x84\0\4\0"), "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"),
    (StatusPacket(1, 0, b"\xa6\0\0\0"), "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
    (
        InstructionPacket(1, Do.WRITE, b"\x74\0\0\2\0\0"),
        "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89",
    ),
    (StatusPacket(1, 0), "FF FF FD 00 01 04 00 55 00 A1 0C"),
    (
        InstructionPacket(1, Do.REG_WRITE, b"\x68\0\xc8\0\0\0"),
        "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E",
    ),
    (InstructionPacket(1, Do.ACTION), "FF FF FD 00 01 03 00 05 02 CE"),
    (InstructionPacket(1, Do.FACTORY_RESET, b"\1"), "FF FF FD 00 01 04 00 06 01 A1 E6"),
    (InstructionPacket(1, Do.REBOOT), "FF FF FD 00 01 03 00 08 2F 4E"),
    (InstructionPacket(1, Do.CLEAR, b"\1DXL\x22"), "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC"),
    (
        InstructionPacket(BROADCAST_ID, Do.SYNC_READ, b"\x84\0\4\0\1\2"),
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
    ),
    (StatusPacket(2, 0, b"\x1f\x08\0\0"), "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE"),
    (
        InstructionPacket(BROADCAST_ID, Do.SYNC_WRITE, b"\x74\0\4\0\1\x96\0\0\0\2\xaa\0\0\0"),
        "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
    ),
    (
        InstructionPacket(BROADCAST_ID, Do.BULK_READ, b"\1\x90\0\2\0\2\x92\0\1\0"),
        "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
    ),
    (
        InstructionPacket(BROADCAST_ID, Do.BULK_WRITE, b"\1\x20\0\2\0\xa0\0\2\x1f\0\1\0\x50"),
        "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68",
    ),
]


def encode(packet: InstructionPacket | StatusPacket) -> bytes:
    if isinstance(packet, StatusPacket):
        return encode_status(packet)
    return encode_instruction(packet)


@pytest.mark.parametrize(("packet", "text"), MANUAL)
def test_worked_packets_both_ways(packet: InstructionPacket | StatusPacket, text: str) -> None:
    raw = bytes.fromhex(text)
    assert encode(packet) == raw
    assert PacketParser().feed(raw) == [packet]


class Recorder:
    """The SDK's port, as far as sending goes."""

    is_using = False
    sent = b""

    def clearPort(self) -> None:
        pass

    def writePort(self, packet: list[int]) -> int:
        self.sent = bytes(packet)
        return len(packet)


@given(st.integers(0, 252), st.binary(max_size=60))
def test_same_bytes_as_the_sdk_where_nothing_needs_stuffing(servo_id: int, params: bytes) -> None:
    if b"\xff\xff\xfd" in params:
        return  # the SDK sends these unstuffed
    port = Recorder()
    length = len(params) + 3
    packet = [0] * 4 + [servo_id, length & 0xFF, length >> 8, Do.WRITE, *params, 0, 0]
    assert Protocol2PacketHandler().txPacket(port, packet) == 0
    assert port.sent == encode_instruction(InstructionPacket(servo_id, Do.WRITE, params))


instructions = st.builds(
    InstructionPacket, st.integers(0, 252), st.sampled_from(list(Do)), st.binary(max_size=80)
)
nasty = st.lists(st.sampled_from([0xFF, 0xFD, 0, 0x55]), max_size=30).map(bytes)
statuses = st.builds(StatusPacket, st.integers(0, 252), st.integers(0, 255), nasty)


@given(st.lists(instructions | statuses, max_size=6), st.integers(1, 50))
def test_round_trip_in_pieces_of_any_size(
    packets: list[InstructionPacket | StatusPacket], size: int
) -> None:
    raw = b"".join(encode(packet) for packet in packets)
    reader = PacketParser()
    pieces = (raw[k : k + size] for k in range(0, len(raw), size))
    assert [packet for piece in pieces for packet in reader.feed(piece)] == packets
    assert (reader.pending, reader.dropped_bytes, reader.crc_errors) == (0, 0, 0)


@pytest.mark.parametrize("servo_id", [-1, 253, 255, 256])
def test_ids_that_no_bus_has_are_refused(servo_id: int) -> None:
    with pytest.raises(ProtocolError, match="0 to 252"):
        encode_instruction(InstructionPacket(servo_id, Do.PING))


def test_alert_and_result_share_the_error_byte() -> None:
    packet = StatusPacket(1, 0x87)
    assert packet.alert
    assert packet.result == 7
