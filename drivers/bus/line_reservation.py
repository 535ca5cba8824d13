"""Until when a line carries what was sent on it: no reply begins before.

A write returns long before its bytes have left. Whoever asks for a reply counts its time from when
the line is free, also where another has sent what is still on it.
"""

import numpy as np

from snakewalk.drivers.clock import Clock, WallClock


class LineReservation:
    """Of one port, shared by all who send on it."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.free_s = np.array([clock.now_s()])
        """(1,) when all that was sent will have left, on the clock, s; compiled code writes it."""

    @property
    def zero_s(self) -> float | None:
        """Zero of the clock in the machine's monotonic time; None of a clock without one."""
        return self._clock.zero_s if isinstance(self._clock, WallClock) else None

    @property
    def since_sent_s(self) -> float:
        """How long ago all that was sent had left the line; 0 while it is still on it."""
        return max(0.0, self._clock.now_s() - float(self.free_s[0]))

    def reserve(self, wire_s: float) -> float:
        """Note that something is sent now; when all will have left, on the clock, s."""
        free_s = max(self._clock.now_s(), float(self.free_s[0])) + wire_s
        self.free_s[0] = free_s
        return free_s
