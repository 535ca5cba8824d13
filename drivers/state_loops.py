"""``StateBlock.motion`` as a loop over bytes, compiled when this is imported, never in a cycle.

Needs numba.
"""
# mypy: disable-error-code="untyped-decorator"

import numpy as np
from numba import float64, int64, njit, types, uint8, void
from numpy.typing import NDArray

from drivers.types import Floats

_BLOCKS = types.Array(uint8, 2, "A", readonly=True)


@njit(int64(_BLOCKS, int64, int64, int64), cache=True)
def _signed(data: NDArray[np.uint8], row: int, at: int, size: int) -> int:
    value = 0
    for k in range(size):
        value |= int(data[row, at + k]) << (8 * k)
    half = 1 << (8 * size - 1)
    return value - 2 * half if value >= half else value


@njit(void(_BLOCKS, float64[::1], float64[::1], float64[:, ::1]), cache=True)
def motion(data: NDArray[np.uint8], zero: Floats, scale: Floats, out: Floats) -> None:
    """Current, velocity and position of blocks (J, 10) into ``out`` (3, J)."""
    for row in range(len(data)):
        out[0, row] = (_signed(data, row, 0, 2) - zero[0]) * scale[0]
        out[1, row] = (_signed(data, row, 2, 4) - zero[1]) * scale[1]
        out[2, row] = (_signed(data, row, 6, 4) - zero[2]) * scale[2]
