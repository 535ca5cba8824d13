"""``StateBlock.motion`` and ``GoalTicks`` as loops, compiled at import, never in a cycle.

Needs numba.
"""

import numpy as np
from numba import boolean, float64, int32, int64, types, uint8, void
from numpy.typing import NDArray

from drivers.compiling import compiled
from drivers.types import Floats

_BLOCKS = types.Array(uint8, 2, "A", readonly=True)
_GOALS = types.Array(float64, 1, "A", readonly=True)


@compiled(int64(_BLOCKS, int64, int64, int64))
def _signed(data: NDArray[np.uint8], row: int, at: int, size: int) -> int:
    value = 0
    for k in range(size):
        value |= int(data[row, at + k]) << (8 * k)
    half = 1 << (8 * size - 1)
    return value - 2 * half if value >= half else value


@compiled(void(_BLOCKS, float64[::1], float64[::1], float64[:, ::1]))
def motion(data: NDArray[np.uint8], zero: Floats, scale: Floats, out: Floats) -> None:
    """Current, velocity and position of blocks (J, 10) into ``out`` (3, J)."""
    for row in range(len(data)):
        out[0, row] = (_signed(data, row, 0, 2) - zero[0]) * scale[0]
        out[1, row] = (_signed(data, row, 2, 4) - zero[1]) * scale[1]
        out[2, row] = (_signed(data, row, 6, 4) - zero[2]) * scale[2]


@compiled(boolean(_GOALS, float64[::1], int32[::1], int32[::1], int32[::1]))
def ticks(
    goal_rad: Floats,
    scale: Floats,
    low: NDArray[np.int32],
    high: NDArray[np.int32],
    out: NDArray[np.int32],
) -> bool:
    """Nearest ticks of goals (J,) within ``low`` to ``high``; false if a goal is no number."""
    for joint in range(len(goal_rad)):
        if not np.isfinite(goal_rad[joint]):
            return False
        tick = np.rint(goal_rad[joint] / scale[0] + scale[1])
        out[joint] = int(min(max(tick, float(low[joint])), float(high[joint])))
    return True
