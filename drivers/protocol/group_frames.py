"""The frames of a control cycle in numpy: bytes of regular answers to values, goals to bytes.

What is not exactly as expected is refused here and left to the careful reader. ``group_loops`` has
the same three functions as loops, for a compiler; ``quickest_frames`` says which to use.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.compiling import COMPILES
from drivers.protocol.crc import crc16_long, crc16_rows

Bytes = NDArray[np.uint8]
IRREGULAR, FLAWLESS, WITH_ERRORS = 0, 1, 2
"""What a reader found: not the expected bytes; all without an error byte; some with one."""
HEAD = 8
"""Bytes of a status packet in front of its error byte, and of a fast answer in front of all."""
PARAMS_AT, VALUES_AT = 8, 12
"""In a sync write: its parameters; behind address and length, the servos' shares."""
SHARE_BYTES = 5
"""In it, of each servo: ID and value."""


class Frames(Protocol):
    """The three functions, in numpy or compiled."""

    def read_plain(self, raw: Bytes, heads: Bytes, data: Bytes, error: Bytes) -> int:
        """Take N status packets apart, none of them stuffed.

        Args:
            raw: what has come.
            heads: (N, 8) how each must begin.
            data: (N, length) filled, unless irregular.
            error: (N,) filled, unless irregular.

        """
        ...

    def read_fast(self, raw: Bytes, head: Bytes, ids: Bytes, data: Bytes, error: Bytes) -> int:
        """Take the answer to a fast read apart: ``head`` (8,), then shares of ``ids`` (N,)."""
        ...

    def fill(self, frame: Bytes, values: NDArray[np.int32]) -> bool:
        """Put ``values`` (N,) and the CRC into a sync write; False if it must be stuffed first."""
        ...


class NumpyFrames:
    """Implements ``Frames`` without a compiler."""

    @staticmethod
    def read_plain(raw: Bytes, heads: Bytes, data: Bytes, error: Bytes) -> int:
        """As ``Frames`` says."""
        count, size = len(heads), data.shape[1] + HEAD + 3
        # FF FF FD anywhere but in the headers: stuffed data, or a CRC that looks so
        if len(raw) != count * size or raw.tobytes().count(b"\xff\xff\xfd") != count:
            return IRREGULAR
        rows = raw.reshape(count, size)
        if not np.array_equal(rows[:, :HEAD], heads):
            return IRREGULAR
        crc = rows[:, -2] | rows[:, -1].astype(np.uint16) << 8
        if not np.array_equal(crc16_rows(rows[:, :-2]), crc):
            return IRREGULAR
        data[:], error[:] = rows[:, HEAD + 1 : -2], rows[:, HEAD]
        return WITH_ERRORS if error.any() else FLAWLESS

    @staticmethod
    def read_fast(raw: Bytes, head: Bytes, ids: Bytes, data: Bytes, error: Bytes) -> int:
        """As ``Frames`` says."""
        count, size = len(ids), data.shape[1] + 4
        if len(raw) != HEAD + count * size or not np.array_equal(raw[:HEAD], head):
            return IRREGULAR
        rows = raw[HEAD:].reshape(count, size)
        if not np.array_equal(rows[:, 1], ids):
            return IRREGULAR
        if crc16_long(raw[:-2]) != int(raw[-2]) | int(raw[-1]) << 8:
            return IRREGULAR
        data[:], error[:] = rows[:, 2:-2], rows[:, 0]
        return WITH_ERRORS if error.any() else FLAWLESS

    @staticmethod
    def fill(frame: Bytes, values: NDArray[np.int32]) -> bool:
        """As ``Frames`` says."""
        shares = frame[VALUES_AT:-2].reshape(len(values), SHARE_BYTES)
        shares[:, 1:] = values.astype("<i4").view(np.uint8).reshape(len(values), 4)
        crc = crc16_long(frame[:-2])
        frame[-2:] = crc & 0xFF, crc >> 8
        return frame.tobytes().find(b"\xff\xff\xfd", PARAMS_AT, -2) < 0


def quickest_frames() -> Frames:
    """The quickest there is here: compiled where numba is installed."""
    if not COMPILES:
        return NumpyFrames()
    from drivers.protocol import group_loops  # noqa: PLC0415  optional, and slow to import

    return group_loops
