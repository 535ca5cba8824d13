"""Question and answer on a serial device in one go: forget, write, nap, look; between no Python.

Needs numba, and a C library as Linux has it. It does what goes smoothly. On a signal, an error, or
when time is up it returns short, and the careful methods of ``SerialPort`` go on from there and
find out what it was. Compiled when this is imported, never in a cycle.

When an answer is complete is known beforehand, to within what driver and operating system add. So
the host sleeps through the time in which the answer comes, instead of waking up for each piece of
it, is awake a little before the end, and looks until it is there: that takes less of the processor
than being woken, and no time. How late (or early) the end really is, is learnt from cycle to cycle.
"""

import numpy as np
from numba import int32, int64, intp, types, uint8, uintp
from numpy.typing import NDArray

from snakewalk.drivers.compiling import compiled

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
_SLACK_NS = 50_000
"""How much later than told Linux ends a program's sleep, so that it may end several at once."""
_LEARNT = 8
"""An answer moves what is expected by one part in so many."""
_LONGEST_STREAK = 16
_RAW = types.Array(uint8, 1, "C", readonly=True)
LATE, STREAK = 0, 1
"""In a ``habit``: how much later than told answers are complete, ns; those too early, in a row."""


def new_habit() -> NDArray[np.int64]:
    """Nothing learnt yet."""
    return np.zeros(2, np.int64)


@compiled(int64(int64[::1]))
def _now_ns(time: NDArray[np.int64]) -> int:
    _clock_gettime(_MONOTONIC, time.ctypes.data)  # into struct timespec
    return int(time[0]) * _SECOND_NS + int(time[1])


@compiled(int64())
def now_ns() -> int:
    """Monotonic time."""
    return int(_now_ns(np.empty(2, np.int64)))


@compiled(int64(int64[::1], int64, int64, int64))
def learn(habit: NDArray[np.int64], late_ns: int, least_ns: int, spin_ns: int) -> int:
    """Take in that an answer was complete ``late_ns`` after it was expected at the earliest.

    One that was there before anybody looked (``late_ns`` = -``least_ns``) may have been there for
    long: each in a row makes the next nap shorter by twice as much, until there is none.
    """
    if late_ns <= -least_ns:
        earlier = spin_ns << habit[STREAK]
        habit[STREAK] = min(habit[STREAK] + 1, _LONGEST_STREAK)
        habit[LATE] = max(habit[LATE] - earlier, -least_ns)
    else:
        off_ns = min(max(late_ns - habit[LATE], -spin_ns), spin_ns)
        habit[STREAK] = 0
        habit[LATE] += off_ns // _LEARNT
    return int(habit[LATE])


@compiled(int64(int32, _RAW))
def put(fd: int, request: NDArray[np.uint8]) -> int:
    """Forget what has come, send ``request``; how many bytes of it were taken."""
    _tcflush(fd, _TCIFLUSH)
    return max(0, int(_write(fd, request.ctypes.data, len(request))))


@compiled(int64(int32, uint8[::1], int64, int64, int64, int64, int64[::1]), nogil=True)
def listen(
    fd: int,
    answer: NDArray[np.uint8],
    begun_ns: int,
    least_ns: int,
    wait_ns: int,
    spin_ns: int,
    habit: NDArray[np.int64],
) -> int:
    """How many bytes have come into ``answer``: all that it has room for, or those in time.

    Args:
        fd: does not block.
        answer: filled; at least 1 byte.
        begun_ns: when the question was put.
        least_ns: until the last byte can have come at the earliest, from then.
        wait_ns: at most, from then.
        spin_ns: for so long before the answer is expected, and after, look without sleeping; 0:
            sleep until something comes, and again, until it is all.
        habit: (2,) as ``new_habit`` makes it; learns.

    """
    time = np.empty(2, np.int64)  # struct timespec
    awaited = np.empty(1, np.int64)  # struct pollfd: descriptor, events, events found
    here, count = answer.ctypes.data, len(answer)
    got = 0
    if spin_ns > 0:
        expected_ns = begun_ns + least_ns + int(habit[LATE])
        nap_ns = expected_ns - spin_ns - _SLACK_NS - _now_ns(time)
        if nap_ns > 0:
            time[0], time[1] = divmod(nap_ns, _SECOND_NS)
            if _ppoll(0, 0, time.ctypes.data, 0) < 0:
                return got  # a signal
        here_ns = _now_ns(time)
        in_time = nap_ns > 0 and here_ns < expected_ns
        looked = False
        while not looked or here_ns < expected_ns + spin_ns:
            more = int(_read(fd, here + got, count - got))
            got += max(more, 0)
            if got == count:
                if looked:
                    learn(habit, _now_ns(time) - begun_ns - least_ns, least_ns, spin_ns)
                elif in_time:  # else it is the host that was late
                    learn(habit, -least_ns, least_ns, spin_ns)
                return got
            looked = more < _PIECE
            here_ns = _now_ns(time)
    end_ns = begun_ns + wait_ns
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
            if spin_ns > 0:
                learn(habit, _now_ns(time) - begun_ns - least_ns, least_ns, spin_ns)
            return got


@compiled(int64(int32, _RAW, uint8[::1], int64), nogil=True)
def exchange(fd: int, request: NDArray[np.uint8], answer: NDArray[np.uint8], wait_ns: int) -> int:
    """``put`` and ``listen``, whenever the answer may come.

    Returns:
        How many bytes have come; ``-1 - n``: only ``n`` bytes of the request were taken.

    """
    begun_ns = now_ns()
    sent = put(fd, request)
    if sent != len(request):
        return -1 - sent
    return int(listen(fd, answer, begun_ns, 0, wait_ns, 0, np.zeros(2, np.int64)))
