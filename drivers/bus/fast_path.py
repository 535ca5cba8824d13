"""Fast path: the regular control cycle of one kind of port, in fewer calls.

It accepts only regular replies. It returns all other bytes unchanged to ``ControlCycle``.
"""

from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Int32s
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation


class FastPath(Protocol):
    """Group read of servos, alone or after their goals."""

    @property
    def remaining_s(self) -> float:
        """Longest remaining time of an irregular reply."""
        ...

    def write(self, goals: Int32s) -> int:
        """Send goals (N,); return the number of bytes sent, 0 if the port must send them."""
        ...

    def begin(self, goals: Int32s | None) -> bool:
        """Send the request, after ``goals`` (N,) if given; False if nothing was sent.

        Raises:
            PortError: the port is gone.

        """
        ...

    def finish(self) -> GroupReadReply | bytes:
        """Receive the reply to the request of ``begin``.

        Returns:
            The reply, or the bytes if they are irregular.

        """
        ...


@runtime_checkable
class FastPathPort(Protocol):
    """A byte port with a fast path of its own: a simulated line."""

    def fast_path(
        self,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
    ) -> FastPath | None:
        """Prepare the packets; None if the port's own calls must be used."""
        ...
