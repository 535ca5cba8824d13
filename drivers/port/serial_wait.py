"""Send a request on a serial device, sleep, and receive its reply, in compiled code.

The loops are compiled at import and use the C library of Linux. They handle the regular case. After
a signal, an error or the deadline they return early, and the methods of ``SerialPort`` continue.
The length of a reply gives its end, except for delays of driver and operating system. So the host
wakes once, shortly before the end, instead of once per piece. Then it polls, or sleeps until the
last bytes. If it polls, it estimates the delay of replies from cycle to cycle.
"""

import numpy as np
from numba import int32, int64, intp, types, uint8, uintp

from snakewalk.config.arrays import Bytes, Ints
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
"""Size of the pieces in which the kernel hands over a terminal's bytes; a smaller one is the
last."""
_TIMER_SLACK_NS = 50_000
"""Linux ends a sleep up to this much late, so that it can end several at once (prctl(2))."""
_GAIN = 8
"""A reply moves the latency estimate by one part in this number (ours)."""
_LONGEST_STREAK = 16
_RAW = types.Array(uint8, 1, "C", readonly=True)
LATE = 0
STREAK = 1
"""Indices of a latency estimate: how much later than computed replies are complete, ns; number of
early replies in a row."""


@compiled(int64(int64[::1]))
def _now_ns(time: Ints) -> int:
    _clock_gettime(_MONOTONIC, time.ctypes.data)  # into struct timespec
    return int(time[0]) * _SECOND_NS + int(time[1])


@compiled(int64())
def now_ns() -> int:
    """Monotonic time."""
    return int(_now_ns(np.empty(2, np.int64)))


@compiled(int64(int64[::1], int64, int64, int64))
def update(latency_estimate: Ints, late_ns: int, least_ns: int, spin_ns: int) -> int:
    """Update the estimate: a reply was complete ``late_ns`` after its earliest possible time.

    If a reply was complete before the first poll (``late_ns`` = -``least_ns``), its real time is
    unknown: each such reply in a row doubles the reduction of the next sleep.
    """
    if late_ns <= -least_ns:
        earlier = spin_ns << latency_estimate[STREAK]
        latency_estimate[STREAK] = min(latency_estimate[STREAK] + 1, _LONGEST_STREAK)
        latency_estimate[LATE] = max(latency_estimate[LATE] - earlier, -least_ns)
    else:
        off_ns = min(max(late_ns - latency_estimate[LATE], -spin_ns), spin_ns)
        latency_estimate[STREAK] = 0
        latency_estimate[LATE] += off_ns // _GAIN
    return int(latency_estimate[LATE])


@compiled(int64(int32, _RAW))
def send(fd: int, request: Bytes) -> int:
    """Discard the input and send ``request``; return the number of bytes sent."""
    _tcflush(fd, _TCIFLUSH)
    return max(0, int(_write(fd, request.ctypes.data, len(request))))


@compiled(int64(int32, uint8[::1], int64, int64, int64, int64, int64[::1]), nogil=True)
def receive(  # noqa: C901  a compiled loop
    fd: int,
    reply: Bytes,
    begun_ns: int,
    least_ns: int,
    wait_ns: int,
    spin_ns: int,
    latency_estimate: Ints,
) -> int:
    """Receive until a reply is complete or the deadline has passed; return the byte count.

    It is one more than the reply if more bytes are on the line.

    Args:
        fd: descriptor, non-blocking.
        reply: (n + 1,) filled; n is the length of the reply, at least 1 byte.
        begun_ns: time of the request.
        least_ns: from then to the earliest possible end of the reply.
        wait_ns: from then to the deadline.
        spin_ns: poll for this duration before and after the expected end; 0: sleep until the
            earliest possible end, then until bytes arrive.
        latency_estimate: (2,) zeros before the first reply; updated.

    """
    time = np.empty(2, np.int64)  # struct timespec
    awaited = np.empty(1, np.int64)  # struct pollfd: descriptor, events, returned events
    data_address = reply.ctypes.data
    count = len(reply) - 1
    got = 0
    if spin_ns > 0:
        expected_ns = begun_ns + least_ns + int(latency_estimate[LATE])
        sleep_ns = expected_ns - spin_ns - _TIMER_SLACK_NS - _now_ns(time)
        if sleep_ns > 0:
            time[0], time[1] = divmod(sleep_ns, _SECOND_NS)
            if _ppoll(0, 0, time.ctypes.data, 0) < 0:
                return got  # a signal
        here_ns = _now_ns(time)
        in_time = sleep_ns > 0 and here_ns < expected_ns
        polled = False
        while not polled or here_ns < expected_ns + spin_ns:
            more = int(_read(fd, data_address + got, count + 1 - got))
            got += max(more, 0)
            if got >= count:
                if polled:
                    late_ns = _now_ns(time) - begun_ns - least_ns
                    update(latency_estimate, late_ns, least_ns, spin_ns)
                elif in_time:  # else the host was late, not the reply early
                    update(latency_estimate, -least_ns, least_ns, spin_ns)
                return got
            polled = more < _PIECE
            here_ns = _now_ns(time)
    else:
        sleep_ns = begun_ns + least_ns - _TIMER_SLACK_NS - _now_ns(time)
        if sleep_ns > 0:
            time[0], time[1] = divmod(sleep_ns, _SECOND_NS)
            if _ppoll(0, 0, time.ctypes.data, 0) < 0:
                return got  # a signal
    end_ns = begun_ns + wait_ns
    while True:
        remaining_ns = max(0, end_ns - _now_ns(time))
        time[0], time[1] = divmod(remaining_ns, _SECOND_NS)
        awaited[0] = fd | _POLLIN << 32
        if _ppoll(awaited.ctypes.data, 1, time.ctypes.data, 0) <= 0:
            return got  # the deadline, or a signal
        more = int(_read(fd, data_address + got, count + 1 - got))
        if more <= 0:
            return got  # the device is gone
        got += more
        while more == _PIECE and got < count:
            more = int(_read(fd, data_address + got, count + 1 - got))
            got += max(more, 0)
        if got >= count:
            if spin_ns > 0:
                late_ns = _now_ns(time) - begun_ns - least_ns
                update(latency_estimate, late_ns, least_ns, spin_ns)
            return got
