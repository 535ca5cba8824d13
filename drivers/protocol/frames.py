"""Frames of a control cycle: goals to bytes, and the bytes of regular replies to values.

The loops are compiled at import, never in a cycle. Irregular replies are left to
``drivers.bus.group_read``.
"""

from snakewalk.config.arrays import Bytes, Int32s
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.protocol.crc import TABLE

IRREGULAR = 0
FLAWLESS = 1
WITH_ERRORS = 2
"""Results: not the expected bytes; no servo reports an error; some servos do."""
HEAD = 8
"""Bytes of a status packet before its error byte, and of a fast reply before its parts."""
PARAMS_AT, VALUES_AT = 8, 12
"""Places in a sync write: its parameters, and its entries behind address and length."""
ENTRY_BYTES = 5
"""Entry of one servo: ID and value."""


_RAW = readonly_array("uint8", layout="C")
_ROW = "uint8[::1]"
_ROWS = "uint8[:, ::1]"


@compiled(f"int64({_RAW}, int64, int64, int64)", makes_arrays=False)
def crc_of(data: Bytes, start: int, stop: int, crc: int) -> int:
    """CRC of a part of ``data``, continued from ``crc``."""
    for k in range(start, stop):
        crc = ((crc << 8) & 0xFFFF) ^ int(TABLE[(crc >> 8) ^ int(data[k])])
    return crc


@compiled(f"boolean({_RAW}, int64, int64)", makes_arrays=False)
def header_in(data: Bytes, start: int, stop: int) -> bool:
    """Whether ``FF FF FD`` is within ``start`` to ``stop``."""
    for k in range(start + 2, stop):
        if data[k] == 0xFD and data[k - 1] == 0xFF and data[k - 2] == 0xFF:
            return True
    return False


@compiled(f"int64({_RAW}, {_ROWS}, {_ROWS}, {_ROW})", makes_arrays=False)
def read_plain(raw: Bytes, heads: Bytes, data: Bytes, error: Bytes) -> int:
    """Decode N unstuffed status packets.

    Args:
        raw: bytes received.
        heads: (N, 8) expected heads.
        data: (N, length) filled, unless irregular.
        error: (N,) filled, unless irregular.

    """
    count, length = data.shape
    size = length + HEAD + 3
    if len(raw) != count * size:
        return IRREGULAR
    outcome = FLAWLESS
    for servo in range(count):
        offset = servo * size
        end = offset + size
        for k in range(HEAD):
            if raw[offset + k] != heads[servo, k]:
                return IRREGULAR
        if crc_of(raw, offset, end - 2, 0) != int(raw[end - 2]) | int(raw[end - 1]) << 8:
            return IRREGULAR
        if header_in(raw, offset + HEAD, end):
            return IRREGULAR
        error[servo] = raw[offset + HEAD]
        if error[servo]:
            outcome = WITH_ERRORS
        for k in range(length):
            data[servo, k] = raw[offset + HEAD + 1 + k]
    return outcome


@compiled(f"int64({_RAW}, {_ROW}, {_ROW}, {_ROWS}, {_ROW})", makes_arrays=False)
def read_fast(raw: Bytes, head: Bytes, ids: Bytes, data: Bytes, error: Bytes) -> int:
    """Decode the reply to a fast read: ``head`` (8,), then the parts of ``ids`` (N,)."""
    count, length = data.shape
    end = HEAD + count * (length + 4)
    if len(raw) != end:
        return IRREGULAR
    for k in range(HEAD):
        if raw[k] != head[k]:
            return IRREGULAR
    if crc_of(raw, 0, end - 2, 0) != int(raw[end - 2]) | int(raw[end - 1]) << 8:
        return IRREGULAR
    outcome = FLAWLESS
    for servo in range(count):
        offset = HEAD + servo * (length + 4)
        if raw[offset + 1] != ids[servo]:
            return IRREGULAR
        error[servo] = raw[offset]
        if error[servo]:
            outcome = WITH_ERRORS
        for k in range(length):
            data[servo, k] = raw[offset + 2 + k]
    return outcome


@compiled(f"boolean({_ROW}, int32[::1])", makes_arrays=False)
def fill(frame: Bytes, values: Int32s) -> bool:
    """Write ``values`` (N,) and the CRC into a sync write; False if it needs stuffing."""
    for servo in range(len(values)):
        value = int(values[servo])
        for k in range(4):
            frame[VALUES_AT + ENTRY_BYTES * servo + 1 + k] = (value >> (8 * k)) & 0xFF
    end = len(frame) - 2
    crc = int(crc_of(frame, 0, end, 0))
    frame[end], frame[end + 1] = crc & 0xFF, crc >> 8
    return not header_in(frame, PARAMS_AT, end)
