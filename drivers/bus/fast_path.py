"""Fast path: the regular control cycle of one kind of port, in fewer calls.

It accepts only what is exactly as expected. Anything else is handed back as it arrived, and
``ControlCycle`` continues with it.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation


class FastPath(Protocol):
    """One group read of servos, alone or behind their goals."""

    @property
    def remaining_s(self) -> float:
        """Longest remaining time of the reply of an irregular cycle."""
        ...

    def write(self, goals: NDArray[np.int32]) -> int:
        """Send goals (N,); returns how many bytes were taken, 0 where the port must send them."""
        ...

    def begin(self, goals: NDArray[np.int32] | None) -> bool:
        """Send the request, behind ``goals`` (N,) if there are any; False if nothing was sent.

        Raises:
            PortError: the port is gone.

        """
        ...

    def finish(self) -> GroupReadReply | bytes:
        """Receive the reply to the request of ``begin``.

        Returns:
            The reply; the bytes that arrived, if they are irregular.

        """
        ...


@runtime_checkable
class FastPathPort(Protocol):
    """A byte port that has one of its own: a simulated line."""

    def fast_path(
        self,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
    ) -> FastPath | None:
        """Prepare the packets; None where all must go through the port's own calls."""
        ...
