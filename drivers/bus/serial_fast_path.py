"""The regular control cycle on a serial device, mostly compiled; see ``fast_path``."""

import numpy as np
from numba import boolean, float64, int32, int64, intp, types, uint8, uintp

from snakewalk.config.arrays import Bytes, Floats, Int32s, Ints
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.compiling import compiled
from snakewalk.drivers.port.byte_port import DescriptorPort
from snakewalk.drivers.port.serial_wait import now_ns, receive, send
from snakewalk.drivers.protocol.frames import FLAWLESS, HEAD, IRREGULAR, fill, read_fast, read_plain

_NO_GOALS = np.zeros(0, np.int32)
_BYTE_NS_BAUD = 10_000_000_000
"""Ten bits a byte: times bytes, divided by the baud rate, ns."""


LATENCY_ESTIMATE = 0
"""Place of the latency estimate in a plan: 2 numbers, first zeros."""
ZERO_NS, BEGUN_NS, REMAINING_NS = 2, 3, 4
"""Zero of the port's clock; time of the request; longest remaining time of the reply of an
irregular cycle."""
WRITE_BYTES = 5
REQUEST_BYTES = 6
HEADS_END = 7
IDS_END = 8
ERROR_END = 9
"""Length of the sync write and of the request behind it; where in ``work`` the expected heads of
the replies end, the IDs, and the error bytes. The reply stands behind them."""
FAST = 10
"""Place in a plan of the flag of a fast read: 1 for a fast read."""
WRITE_NS, REQUEST_NS, REPLY_NS, LATENCY_NS = 11, 12, 13, 14
"""Places in a plan of the times of the packets on the line, and of the largest delay of the
reply."""
SPIN_NS = 15
"""Place in a plan of the polling time, an argument of ``receive``."""
PLAN_SIZE = 16
_write = types.ExternalFunction("write", intp(int32, intp, uintp))
_ROW = uint8[::1]
_ROWS = uint8[:, ::1]


class SerialFastPath:
    """Group read of servos on ``port``, alone or after their goals."""

    def __init__(
        self,
        port: DescriptorPort,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
        spin_s: float,
    ) -> None:
        """Prepare the packets; the clock of ``line`` is a ``WallClock``.

        ``latency_s`` is the largest delay of adapter and driver. ``spin_s`` as in ``ControlCycle``.
        """
        self._port = port
        self._request = request
        self._free_s = line.free_s
        count = len(request.ids)
        self._values = np.zeros(count, np.int32)
        self._shape = (count, request.length)
        head = goals.template(), request.packet, request.heads, request.ids
        parts = [np.frombuffer(bytes(part), np.uint8) for part in head]
        ends = np.cumsum([len(part) for part in parts])
        reply_at = int(ends[3]) + count
        self._work = np.zeros(reply_at + request.reply_bytes + 1, np.uint8)
        self._work[: ends[3]] = np.concatenate(parts)
        self._write_bytes, self._request_end = int(ends[0]), int(ends[1])
        self._error = self._work[ends[3] : reply_at]
        self._room = self._work[reply_at:]
        self._plan = np.zeros(PLAN_SIZE, np.int64)
        self._plan[WRITE_BYTES], self._plan[REQUEST_BYTES] = ends[0], ends[1] - ends[0]
        self._plan[HEADS_END : ERROR_END + 1] = ends[2], ends[3], reply_at
        self._plan[ZERO_NS], self._plan[FAST] = (line.zero_s or 0.0) * 1e9, request.fast
        self._plan[LATENCY_NS], self._plan[SPIN_NS] = latency_s * 1e9, spin_s * 1e9
        self._baud = 0
        self._awaited = -1, False

    @property
    def remaining_s(self) -> float:
        """Longest remaining time of an irregular reply."""
        return float(self._plan[REMAINING_NS] * 1e-9)

    def write(self, goals: Int32s) -> int:
        """Send goals (N,); return the number of bytes sent, 0 if the port must send them."""
        fd = self._port.descriptor
        if fd is None:
            return 0
        if self._port.getBaudRate() != self._baud:
            self._update_wire_times()
        values = self._values
        values[:] = goals
        return int(_send_goals(fd, self._work, values, self._plan, self._free_s))

    def begin(self, goals: Int32s | None) -> bool:
        """Send the request, after ``goals`` (N,) if given; False if nothing was sent.

        Raises:
            PortError: the port is gone.

        """
        fd = self._port.descriptor
        if fd is None:
            return False
        values = _NO_GOALS
        if goals is not None:
            values = self._values
            values[:] = goals
        sent = _send_request(fd, self._work, values, self._plan)
        begin = self._write_bytes if goals is None else 0
        if sent < self._request_end - begin:
            if not sent:
                return False
            self._port.write(self._work[begin + sent : self._request_end].tobytes())
        self._awaited = fd, goals is not None
        return True

    def finish(self) -> GroupReadReply | bytes:
        """Receive the reply to the request of ``begin``.

        Returns:
            The reply, or the bytes if they are irregular.

        """
        # the bytes are on the line meanwhile: this time is free
        fd, with_goals = self._awaited
        if self._port.getBaudRate() != self._baud:
            self._update_wire_times()
        data = np.empty(self._shape, np.uint8)
        reply = self._request.regular(FLAWLESS, data, self._error)
        outcome = _receive(fd, self._work, data, with_goals, self._plan, self._free_s)
        if outcome == FLAWLESS:
            return reply
        if outcome > IRREGULAR:
            return self._request.regular(outcome, data, self._error)
        return self._room[: len(self._room) - 1 if outcome == IRREGULAR else -1 - outcome].tobytes()

    def _update_wire_times(self) -> None:
        self._baud = baud = self._port.getBaudRate()
        plan = self._plan
        counts = int(plan[WRITE_BYTES]), int(plan[REQUEST_BYTES]), len(self._room) - 1
        for time, count in zip((WRITE_NS, REQUEST_NS, REPLY_NS), counts, strict=True):
            plan[time] = count * _BYTE_NS_BAUD // baud


@compiled(int64(float64[::1], int64, int64))
def _reserve_line(free_s: Floats, from_ns: int, wire_ns: int) -> int:
    """Note bytes sent at ``from_ns`` (port's clock); return the time until they have left, ns."""
    free_s[0] = max(from_ns * 1e-9, free_s[0]) + wire_ns * 1e-9
    return int(free_s[0] * 1e9) - from_ns


@compiled(int64(int32, _ROW, int32[::1], int64[::1], float64[::1]))
def _send_goals(fd: int, work: Bytes, values: Int32s, plan: Ints, free_s: Floats) -> int:
    """Fill ``values`` into the sync write and send it; return the number of bytes sent.

    It is 0 if the frame needs stuffing, or the device is gone or full.
    """
    frame = work[: plan[WRITE_BYTES]]
    if not fill(frame, values):
        return 0
    begun_ns = now_ns()
    sent = max(0, int(_write(fd, frame.ctypes.data, len(frame))))
    if sent > 0:
        _reserve_line(free_s, begun_ns - plan[ZERO_NS], plan[WRITE_NS])
    return sent


@compiled(int64(int32, _ROW, int32[::1], int64[::1]))
def _send_request(fd: int, work: Bytes, values: Int32s, plan: Ints) -> int:
    """Discard the input, send the request, after ``values`` if given.

    Returns the number of bytes sent.
    """
    begin = int(plan[WRITE_BYTES])
    end = begin + int(plan[REQUEST_BYTES])
    if len(values) > 0:
        if not fill(work[:begin], values):
            return 0
        begin = 0
    plan[BEGUN_NS] = now_ns()
    return int(send(fd, work[begin:end]))


@compiled(int64(int32, _ROW, _ROWS, boolean, int64[::1], float64[::1]), nogil=True)
def _receive(
    fd: int,
    work: Bytes,
    data: Bytes,
    with_goals: bool,
    plan: Ints,
    free_s: Floats,
) -> int:
    """Wait for the reply and decode it.

    Args:
        fd: descriptor, non-blocking.
        work: packets, expected reply, and received bytes, in the order of the plan.
        data: (N, length) filled, unless irregular.
        with_goals: whether goals preceded the request.
        plan: (``PLAN_SIZE``,) the numbers above.
        free_s: (1,) of the line's ``LineReservation``.

    Returns:
        Result of the frame reader for a complete reply. ``-1 - n``: ``n`` bytes arrived, too few or
        one too many; then the line carries more than the reply.

    """
    begun_ns, wire_ns = int(plan[BEGUN_NS]), int(plan[REQUEST_NS])
    if with_goals:
        wire_ns += int(plan[WRITE_NS])
    least_ns = _reserve_line(free_s, begun_ns - plan[ZERO_NS], wire_ns) + int(plan[REPLY_NS])
    wait_ns = least_ns + int(plan[LATENCY_NS])
    request_end = int(plan[WRITE_BYTES] + plan[REQUEST_BYTES])
    heads_end, ids_end, error_end = plan[HEADS_END], plan[IDS_END], plan[ERROR_END]
    room = work[error_end:]
    error = work[ids_end:error_end]
    reply = room[:-1]
    latency_estimate = plan[LATENCY_ESTIMATE : LATENCY_ESTIMATE + 2]
    received = receive(fd, room, begun_ns, least_ns, wait_ns, plan[SPIN_NS], latency_estimate)
    if received != len(reply):
        code = -1 - int(received)
    elif plan[FAST]:
        head = work[request_end:heads_end]
        ids = work[heads_end:ids_end]
        code = int(read_fast(reply, head, ids, data, error))
    else:
        heads = work[request_end:heads_end].reshape(len(data), HEAD)
        code = int(read_plain(reply, heads, data, error))
    if code <= 0:
        plan[REMAINING_NS] = begun_ns + wait_ns - now_ns()
    return code
