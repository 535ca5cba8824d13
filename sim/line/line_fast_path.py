"""The regular control cycle on a simulated line: a group read without queues and parsers.

It gives the bytes of the wire, which handles all special cases (faults, taps, stuffing, two packets
under way).
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bytes
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.protocol.frames import IRREGULAR
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE


class ReadableLine(Protocol):
    """A line with begin and end of a group read; see ``sim.line.sim_line``."""

    @property
    def clock(self) -> Clock:
        """As of a ``BytePort``."""
        ...

    def begin(self, packet: bytes) -> bool:
        """Send a packet on an idle line."""
        ...

    def finish(self, request: GroupReadRequest, data: Bytes, error: Bytes, limit_s: float) -> int:
        """Receive the reply."""
        ...

    def getBaudRate(self) -> int:  # noqa: N802  the SDK's name
        """Method of ``SdkPort``."""
        ...


class LineFastPath:
    """``drivers.bus.fast_path.FastPath`` of a simulated line."""

    def __init__(
        self,
        wire: ReadableLine,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
    ) -> None:
        self._wire = wire
        self._goals = goals
        self._request = request
        self._line = line
        self._latency_s = latency_s
        self._shape = len(request.ids), request.length
        self._error = np.zeros(len(request.ids), np.uint8)
        self._limit_s = 0.0

    @property
    def remaining_s(self) -> float:
        """Remaining time of the last request's reply."""
        return self._limit_s - self._wire.clock.now_s()

    def write(self, goals: NDArray[np.int32]) -> int:
        """Send goals (N,); return the number of bytes sent, 0 if the port must send them."""
        packet = self._goals.encode(goals)
        if not self._wire.begin(packet):
            return 0
        self._line.reserve(len(packet) * BITS_PER_BYTE / self._wire.getBaudRate())
        return len(packet)

    def begin(self, goals: NDArray[np.int32] | None) -> bool:
        """Send the request; False without sending after ``goals`` or on a busy line."""
        request = self._request
        wire = self._wire
        if goals is not None or not wire.begin(request.packet):
            return False
        byte_s = BITS_PER_BYTE / wire.getBaudRate()
        free_s = self._line.reserve(len(request.packet) * byte_s)
        self._limit_s = free_s + request.reply_bytes * byte_s + self._latency_s
        return True

    def finish(self) -> GroupReadReply | bytes:
        """Receive the reply to the request of ``begin``; empty if ``read_until`` must read it."""
        data = np.empty(self._shape, np.uint8)
        outcome = self._wire.finish(self._request, data, self._error, self._limit_s)
        return b"" if outcome == IRREGULAR else self._request.regular(outcome, data, self._error)
