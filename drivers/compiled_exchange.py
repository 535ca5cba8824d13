"""Question and answer on a serial device in one go: forget, write, wait, read; between no Python.

Needs numba, and a C library as Linux has it. It does what goes smoothly. On a signal, an error, or
when time is up it returns short, and ``SerialPort`` goes on from there with its careful methods,
which find out what it was. Compiled when this is imported, never in a cycle.
"""

import numpy as np
from numba import int32, int64, intp, types, uint8, uintp
from numpy.typing import NDArray

from drivers.compiling import compiled

_tcflush = types.ExternalFunction("tcflush", int32(int32, int32))
_read = types.ExternalFunction("read", intp(int32, intp, uintp))
_write = types.ExternalFunction("write", intp(int32, intp, uintp))
_ppoll = types.ExternalFunction("ppoll", int32(intp, uintp, intp, intp))
_clock_gettime = types.ExternalFunction("clock_gettime", int32(int32, intp))

_MONOTONIC = 1  # CLOCK_MONOTONIC
_POLLIN = 1
_SECOND_NS = 1_000_000_000
_TCIFLUSH = 0
_PIECE = 64
"""The kernel hands a terminal's bytes over in pieces of this size; a smaller one was the last."""
_RAW = types.Array(uint8, 1, "C", readonly=True)


@compiled(int64(int64[::1]), nogil=True)
def _now_ns(time: NDArray[np.int64]) -> int:
    _clock_gettime(_MONOTONIC, time.ctypes.data)
    return int(time[0]) * _SECOND_NS + int(time[1])


@compiled(int64(int32, _RAW, uint8[::1], int64, int64), nogil=True)
def exchange(
    fd: int, request: NDArray[np.uint8], answer: NDArray[np.uint8], count: int, wait_ns: int
) -> int:
    """How many of ``count`` bytes have come into ``answer``.

    A negative number, ``-1 - n``, says that only ``n`` bytes of the request were taken. What had
    come before is thrown away.

    Args:
        fd: does not block.
        request: to send.
        answer: (at least ``count``,) filled.
        count: of bytes expected, at least 1.
        wait_ns: at most, from the moment when the request is taken.

    """
    time = np.empty(2, np.int64)  # struct timespec
    awaited = np.empty(1, np.int64)  # struct pollfd: descriptor, events, events found
    here = answer.ctypes.data
    _tcflush(fd, _TCIFLUSH)
    sent = int(_write(fd, request.ctypes.data, len(request)))
    if sent != len(request):
        return -1 - max(sent, 0)
    end_ns = _now_ns(time) + wait_ns
    got = 0
    while True:
        left_ns = max(0, end_ns - _now_ns(time))
        time[0], time[1] = divmod(left_ns, _SECOND_NS)
        awaited[0] = fd | _POLLIN << 32
        if _ppoll(awaited.ctypes.data, 1, time.ctypes.data, 0) <= 0:
            return got  # time is up, or a signal
        more = int(_read(fd, here + got, count - got))
        if more <= 0:
            return got  # the device is gone
        got += more
        while more == _PIECE and got < count:
            more = int(_read(fd, here + got, count - got))
            got += max(more, 0)
        if got == count:
            return got
