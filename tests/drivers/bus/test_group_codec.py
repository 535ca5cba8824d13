"""The vectorised packets of a cycle against the general codec, and against the SDK's reader."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.drivers.bus import group_read, group_write
from snakewalk.drivers.bus.group_read import GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.protocol import frames
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

HEADER_LIKE = int.from_bytes(b"\xff\xff\xfd\xff", "little", signed=True)
raw_goals = st.integers(-(2**31), 2**31 - 1) | st.sampled_from([HEADER_LIKE, -1, -131073])
nasty_block = st.lists(st.sampled_from([0xFF, 0xFD, 0, 7]), min_size=10, max_size=10).map(bytes)
blocks = st.lists(nasty_block | st.binary(min_size=10, max_size=10), min_size=1, max_size=9)

both_ways = pytest.mark.parametrize("compiled", [True, False], ids=["compiled", "as it stands"])


@contextmanager
def loops(compiled: bool) -> Iterator[None]:
    """Run the frame loops compiled, or as they stand."""
    if compiled:
        yield
        return
    with (
        patch.object(group_read, "read_plain", frames.read_plain.py_func),
        patch.object(group_read, "read_fast", frames.read_fast.py_func),
        patch.object(group_write, "fill", frames.fill.py_func),
    ):
        yield


def plain(data: list[bytes], errors: list[int] | None = None) -> bytes:
    codes = errors or [0] * len(data)
    return b"".join(
        encode_status(StatusPacket(k + 1, e, d))
        for k, (d, e) in enumerate(zip(data, codes, strict=True))
    )


def fast(
    data: list[bytes], errors: list[int] | None = None, ids: tuple[int, ...] | None = None
) -> bytes:
    """Written down share by share, as the servos do on the wire."""
    names = ids or tuple(range(1, len(data) + 1))
    codes = errors or [0] * len(data)
    length = 1 + sum(len(d) + 4 for d in data)
    raw = HEADER + bytes([BROADCAST_ID]) + length.to_bytes(2, "little") + b"\x55"
    for name, d, e in zip(names, data, codes, strict=True):
        raw += bytes([e, name]) + d
        raw += crc16(raw).to_bytes(2, "little")
    return raw


@both_ways
@given(st.lists(raw_goals, min_size=1, max_size=9))
def test_goals_are_a_sync_write_stuffed_where_needed(compiled: bool, goals: list[int]) -> None:
    with loops(compiled):
        params = (116).to_bytes(2, "little") + b"\x04\x00"
        for k, goal in enumerate(goals):
            params += bytes([k + 1]) + goal.to_bytes(4, "little", signed=True)
        expected = encode_instruction(
            InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, params)
        )
        writer = GroupWrite(range(1, len(goals) + 1), 116)
        writer.encode(np.zeros(len(goals), np.int32))  # nothing of one packet stays in the next
        assert writer.encode(np.array(goals, np.int32)) == expected


@both_ways
@given(blocks)
def test_plain_answers_with_any_stuffing(compiled: bool, data: list[bytes]) -> None:
    with loops(compiled):
        request = GroupReadRequest(range(1, len(data) + 1), 126, 10, fast=False)
        reply = request.parse(plain(data))
        assert [row.tobytes() for row in reply.data] == data
        assert reply.valid.all()
        assert reply.clean


@both_ways
@given(blocks)
def test_fast_answers_are_never_unstuffed(compiled: bool, data: list[bytes]) -> None:
    with loops(compiled):
        request = GroupReadRequest(range(1, len(data) + 1), 126, 10, fast=True)
        reply = request.parse(fast(data))
        assert [row.tobytes() for row in reply.data] == data
        assert reply.valid.all()
        assert reply.clean
        assert reply.flawless


@pytest.mark.fast_cases(1)
@both_ways
@settings(derandomize=True)  # one damage in 65536 has a right CRC
@given(blocks, st.booleans(), st.data())
def test_what_is_valid_after_damage_is_what_was_sent(
    compiled: bool, data: list[bytes], is_fast: bool, draw: st.DataObject
) -> None:
    with loops(compiled):
        request = GroupReadRequest(range(1, len(data) + 1), 126, 10, fast=is_fast)
        raw = bytearray(fast(data) if is_fast else plain(data))
        start = draw.draw(st.integers(0, len(raw) - 1))
        del raw[start : start + draw.draw(st.integers(0, 5))]
        for _ in range(draw.draw(st.integers(0, 2))):
            at = draw.draw(st.integers(0, max(0, len(raw) - 1)))
            if raw:
                raw[at] ^= draw.draw(st.integers(0, 255))
        reply = request.parse(bytes(raw))
        for k in np.flatnonzero(reply.valid):
            assert reply.data[k].tobytes() == data[k]
        assert reply.valid_count == reply.valid.sum()
        assert not reply.flawless or (reply.valid.all() and not reply.error.any())


@given(st.integers(0, 15))
def test_one_lost_servo_costs_one_servo(lost: int) -> None:
    data = [bytes([k]) * 10 for k in range(16)]
    shares = [plain(data)[21 * k : 21 * (k + 1)] for k in range(16)]
    reply = GroupReadRequest(range(1, 17), 126, 10, fast=False).parse(
        b"".join(share for k, share in enumerate(shares) if k != lost)
    )
    assert reply.valid.tolist() == [k != lost for k in range(16)]
    assert reply.answered.tolist() == reply.valid.tolist()


def test_a_cut_fast_answer_gives_the_shares_before_the_cut() -> None:
    data = [bytes([k]) * 10 for k in range(4)]
    reply = GroupReadRequest([1, 2, 3, 4], 126, 10, fast=True).parse(fast(data)[: 8 + 2 * 14 + 9])
    assert reply.valid.tolist() == [True, True, False, False]
    assert not reply.clean


@both_ways
def test_the_error_byte_of_each_servo_comes_through(compiled: bool) -> None:
    with loops(compiled):
        data = [bytes(10)] * 4
        for is_fast, build in ((False, plain), (True, fast)):
            request = GroupReadRequest([1, 2, 3, 4], 126, 10, fast=is_fast)
            reply = request.parse(build(data, [0, 0x80, 0x03, 0x87]))
            assert reply.error.tolist() == [0, 0x80, 0x03, 0x87]
            assert reply.valid.tolist() == [True, True, False, False]  # an alert still has values
            assert reply.answered.all()
            assert not reply.flawless
            assert reply.valid_count == 2


def test_an_error_without_data_is_an_answer_but_no_value() -> None:
    raw = plain([bytes(10)]) + encode_status(StatusPacket(2, 0x07)) + encode_status(
        StatusPacket(3, 0, bytes(10))
    )  # fmt: skip
    reply = GroupReadRequest([1, 2, 3], 126, 10, fast=False).parse(raw)
    assert reply.valid.tolist() == [True, False, True]
    assert reply.answered.all()
    assert reply.error[1] == 7


def test_two_answers_of_one_servo_are_none() -> None:
    raw = plain([b"a" * 10, b"b" * 10]) + encode_status(StatusPacket(1, 0, b"c" * 10))
    reply = GroupReadRequest([1, 2], 126, 10, fast=False).parse(raw)
    assert reply.valid.tolist() == [False, True]
    assert not reply.clean


def test_an_answer_of_another_length_is_not_this_questions() -> None:
    request = GroupReadRequest([1, 2], 126, 11, fast=False)
    reply = request.parse(plain([b"a" * 10, b"b" * 10]))
    assert not reply.valid.any()
    fast_request = GroupReadRequest([1, 2], 126, 11, fast=True)
    assert not fast_request.parse(fast([b"a" * 10, b"b" * 10])).valid.any()


@pytest.mark.parametrize("is_fast", [False, True])
@given(st.data())
def test_compiled_or_not_the_loops_refuse_and_accept_the_same(
    is_fast: bool, draw: st.DataObject
) -> None:
    data = [bytes([k]) * 10 for k in range(3)]
    codes = draw.draw(st.lists(st.sampled_from([0, 0x80, 7]), min_size=3, max_size=3))
    raw = bytearray(fast(data, codes) if is_fast else plain(data, codes))
    for _ in range(draw.draw(st.integers(0, 1))):
        raw[draw.draw(st.integers(0, len(raw) - 1))] = draw.draw(st.integers(0, 255))
    found = []
    for compiled in (True, False):
        with loops(compiled):
            request = GroupReadRequest([1, 2, 3], 126, 10, fast=is_fast)
            found.append(request._regular(np.frombuffer(raw, np.uint8)))
    one, other = found
    if one is None or other is None:
        assert one is other
        return
    for field in ("data", "valid", "error", "answered"):
        assert (getattr(one, field) == getattr(other, field)).all()
