from collections.abc import Callable

import numpy as np
import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import example, given
from hypothesis import strategies as st

from snakewalk.drivers.errors import StuffingError
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.frames import crc_of
from snakewalk.drivers.protocol.packet import stuff, unstuff

Crc = Callable[[np.ndarray, int, int, int], int]
HEADER = b"\xff\xff\xfd"
# bytes that make the pattern likely
NASTY = st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55, 0xFE]), max_size=40).map(bytes)


@given(st.binary(max_size=300))
def test_crc_is_that_of_the_sdk(data: bytes) -> None:
    assert crc16(data) == Protocol2PacketHandler().updateCRC(0, data, len(data))


def test_crc_check_value_of_buypass() -> None:
    # Catalogue of parametrised CRC algorithms, CRC-16/UMTS (alias BUYPASS): check 0xFEE8
    assert crc16(b"123456789") == 0xFEE8


@given(st.binary(max_size=60), st.binary(max_size=60))
def test_crc_goes_on_from_a_start(head: bytes, tail: bytes) -> None:
    assert crc16(tail, crc16(head)) == crc16(head + tail)


INTERPRETED: Crc = getattr(crc_of, "py_func", crc_of)
"""Without numba, and with NUMBA_DISABLE_JIT=1, the loop itself."""


@pytest.mark.parametrize("loop", [crc_of, INTERPRETED], ids=["compiled", "interpreted"])
@given(st.binary(max_size=60), st.integers(0, 60))
def test_the_compiled_crc_continues_from_any_place(loop: Crc, data: bytes, cut: int) -> None:
    raw, cut = np.frombuffer(data, np.uint8), min(cut, len(data))
    assert loop(raw, cut, len(raw), loop(raw, 0, cut, 0)) == crc16(data)


@given(st.integers(1, 40), st.data())
def test_crc_notices_every_burst_of_up_to_16_bits(length: int, data: st.DataObject) -> None:
    bits = data.draw(st.integers(1, 0xFFFF))
    at = data.draw(st.integers(0, max(0, 8 * length - 16)))
    error = (bits << at) & ((1 << 8 * length) - 1)
    assert error == 0 or crc16(error.to_bytes(length, "big")) != 0


@given(NASTY)
@example(HEADER)
@example(HEADER * 3)
@example(b"\xff" + HEADER + b"\xfd\xfd")
def test_stuffing_round_trip(data: bytes) -> None:
    stuffed = stuff(data)
    assert unstuff(stuffed) == data
    assert len(stuffed) == len(data) + data.count(HEADER)


@given(NASTY)
def test_stuffed_bytes_never_look_like_a_header(data: bytes) -> None:
    assert HEADER + b"\x00" not in stuff(data) + b"\x00"


@given(NASTY)
def test_unstuffing_takes_exactly_what_stuffing_makes(data: bytes) -> None:
    try:
        plain = unstuff(data)
    except StuffingError:
        assert HEADER in data.replace(HEADER + b"\xfd", b"")
    else:
        assert stuff(plain) == data


@pytest.mark.parametrize("data", [HEADER, b"\x01" + HEADER + b"\x00", HEADER + b"\xfd" + HEADER])
def test_bare_header_in_a_payload_is_an_error(data: bytes) -> None:
    with pytest.raises(StuffingError):
        unstuff(data)
