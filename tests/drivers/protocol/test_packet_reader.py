"""The parser through noise, cuts, false headers and broken stuffing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    HEADER,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser

GOOD = StatusPacket(7, 0, b"\xa6\x00\x00\x00")
RAW = encode_status(GOOD)


@given(st.binary(max_size=200), st.integers(1, 30))
def test_a_packet_behind_noise_is_found_and_every_byte_accounted_for(
    noise: bytes, size: int
) -> None:
    reader = PacketParser(max_length=64)
    raw = noise + RAW + bytes(80)  # what follows ends the longest false packet
    found = [p for k in range(0, len(raw), size) for p in reader.feed(raw[k : k + size])]
    assert GOOD in found
    assert reader.pending <= 64 + 7


@given(st.data())
def test_no_flipped_bit_gives_a_wrong_packet(data: st.DataObject) -> None:
    bit = data.draw(st.integers(0, 8 * len(RAW) - 1))
    broken = bytearray(RAW)
    broken[bit // 8] ^= 1 << bit % 8
    reader = PacketParser(max_length=64)
    assert [p for p in reader.feed(bytes(broken) + RAW + bytes(80)) if p != GOOD] == []


def test_a_wrong_length_field_does_not_hide_the_next_packet() -> None:
    broken = bytearray(RAW)
    broken[5] = 30  # claims the next packet's bytes as its own
    reader = PacketParser()
    assert reader.feed(bytes(broken) + RAW + RAW + RAW) == [GOOD] * 3
    assert reader.crc_errors == 1
    assert reader.dropped_bytes == len(RAW)


def test_a_huge_length_is_noise_at_once() -> None:
    reader = PacketParser(max_length=100)
    assert reader.feed(HEADER + b"\x01\xff\x7f\x55\x00\x00" + RAW) == [GOOD]


def test_memory_stays_bounded_under_endless_noise() -> None:
    rng = np.random.default_rng(1)
    reader = PacketParser(max_length=256)
    for _ in range(200):
        reader.feed(rng.choice(np.frombuffer(b"\xff\xfd\x00\x01\x55", np.uint8), 64).tobytes())
        assert reader.pending <= 256 + 7
    reader.reset()
    assert reader.dropped_bytes == 200 * 64
    assert reader.feed(RAW) == [GOOD]


def test_a_right_crc_over_broken_stuffing_is_no_packet() -> None:
    body = HEADER + b"\x07\x08\x00\x55\x00\xff\xff\xfd\x00"
    reader = PacketParser()
    assert reader.feed(body + crc16(body).to_bytes(2, "little") + RAW) == [GOOD]
    assert reader.stuffing_errors == 1


def test_fast_answers_are_not_stuffed() -> None:
    packet = StatusPacket(BROADCAST_ID, 0, b"\x01\xff\xff\xfd\x00\xab\xcd\x00\x02\x01\x02\x03\x04")
    raw = encode_status(packet)
    assert raw.count(b"\xff\xff\xfd") == 2
    assert len(raw) == 9 + len(packet.params) + 2
    assert PacketParser().feed(raw) == [packet]


@pytest.mark.parametrize("cut", range(1, len(RAW)))
def test_a_cut_packet_is_forgotten_at_reset(cut: int) -> None:
    reader = PacketParser()
    assert reader.feed(RAW[:cut]) == []
    reader.reset()
    assert reader.feed(RAW) == [GOOD]


def test_unknown_instructions_are_handed_on() -> None:
    packet = InstructionPacket(3, 0x77, b"\x01")
    assert packet.instruction not in list(Instruction)
    assert PacketParser().feed(encode_instruction(packet)) == [packet]
