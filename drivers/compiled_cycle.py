"""A control cycle in two compiled calls: goals and question out; answer in, and its checks.

``drivers.protocol.group_loops`` around ``drivers.compiled_exchange``, joined so that after a sleep,
when nothing of a program is left in the processor's caches, as little as possible must be fetched:
one array of bytes, one of numbers. Two, so that Python can prepare the result while the bytes are
on the line. Compiled when this is imported, never in a cycle. (The compiler's cache looks at this
file alone: when one of the two above has changed, touch it.)
"""

import numpy as np
from numba import boolean, int32, int64, intp, types, uint8, uintp
from numpy.typing import NDArray

from drivers.compiled_exchange import listen, now_ns, put
from drivers.compiling import compiled
from drivers.protocol.group_frames import HEAD
from drivers.protocol.group_loops import fill, read_fast, read_plain

Bytes = NDArray[np.uint8]

HABIT = 0
"""In a plan, 2 numbers: as ``new_habit`` makes them."""
FREE_NS, BEGUN_NS, LEFT_NS = 2, 3, 4
"""When what was sent has left the line; when the question was put; after a cycle that went wrong,
how long its answer may still take."""
WRITE_BYTES, ASK_BYTES, HEADS_END, IDS_END, ERROR_END = 5, 6, 7, 8, 9
"""Length of the sync write and of the question behind it; where in ``work`` the heads that an
answer must have end, the IDs, and the error bytes; behind them is the answer."""
FAST = 10
"""1: the answer is one to a fast read."""
WRITE_NS, ASK_NS, ANSWER_NS, LATENCY_NS = 11, 12, 13, 14
"""How long the packets are on the line, and what may delay the answer."""
SPIN_NS = 15
"""As ``listen`` has it."""
PLAN_SIZE = 16

_write = types.ExternalFunction("write", intp(int32, intp, uintp))
_ROW, _ROWS = uint8[::1], uint8[:, ::1]


@compiled(int64(int64[::1], int64, int64))
def occupy(plan: NDArray[np.int64], from_ns: int, wire_ns: int) -> int:
    """Note what was sent at ``from_ns``; how long from then until it has left the line, ns."""
    plan[FREE_NS] = max(from_ns, plan[FREE_NS]) + wire_ns
    return int(plan[FREE_NS] - from_ns)


@compiled(int64(int32, _ROW, int32[::1], int64[::1]))
def send(fd: int, work: Bytes, values: NDArray[np.int32], plan: NDArray[np.int64]) -> int:
    """Put ``values`` into the sync write and send it; how many bytes were taken.

    None are where the frame must be stuffed, or the device is gone or full.
    """
    frame = work[: plan[WRITE_BYTES]]
    if not fill(frame, values):
        return 0
    begun_ns = now_ns()
    sent = max(0, int(_write(fd, frame.ctypes.data, len(frame))))
    if sent > 0:
        occupy(plan, begun_ns, plan[WRITE_NS])
    return sent


@compiled(int64(int32, _ROW, int32[::1], int64[::1]))
def ask(fd: int, work: Bytes, values: NDArray[np.int32], plan: NDArray[np.int64]) -> int:
    """Put the question, behind ``values`` if there are any; how many bytes were taken, as ``send``.

    What had come before is thrown away.
    """
    begin = int(plan[WRITE_BYTES])
    end = begin + int(plan[ASK_BYTES])
    if len(values) > 0:
        if not fill(work[:begin], values):
            return 0
        begin = 0
    plan[BEGUN_NS] = now_ns()
    return int(put(fd, work[begin:end]))


@compiled(int64(int32, _ROW, _ROWS, boolean, int64[::1]), nogil=True)
def hear(fd: int, work: Bytes, data: Bytes, with_goals: bool, plan: NDArray[np.int64]) -> int:
    """Wait for the answer, and read it.

    Args:
        fd: does not block.
        work: packets, what is expected, and what has come, in the order that the plan says.
        data: (N, length) filled, unless irregular.
        with_goals: whether the question went behind goals.
        plan: (``PLAN_SIZE``,) the numbers above.

    Returns:
        What ``Frames`` says of a complete answer; ``-1 - n``: only ``n`` bytes have come.

    """
    begun_ns, wire_ns = int(plan[BEGUN_NS]), int(plan[ASK_NS])
    if with_goals:
        wire_ns += int(plan[WRITE_NS])
    least_ns = occupy(plan, begun_ns, wire_ns) + int(plan[ANSWER_NS])
    wait_ns = least_ns + int(plan[LATENCY_NS])
    asked = int(plan[WRITE_BYTES] + plan[ASK_BYTES])
    heads_end, ids_end, error_end = plan[HEADS_END], plan[IDS_END], plan[ERROR_END]
    answer, error = work[error_end:], work[ids_end:error_end]
    habit = plan[HABIT : HABIT + 2]
    got = listen(fd, answer, begun_ns, least_ns, wait_ns, plan[SPIN_NS], habit)
    if got < len(answer):
        found = -1 - int(got)
    elif plan[FAST]:
        head, ids = work[asked:heads_end], work[heads_end:ids_end]
        found = int(read_fast(answer, head, ids, data, error))
    else:
        heads = work[asked:heads_end].reshape(len(data), HEAD)
        found = int(read_plain(answer, heads, data, error))
    if found <= 0:
        plan[LEFT_NS] = begun_ns + wait_ns - now_ns()
    return found
