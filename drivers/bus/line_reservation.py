"""Time until which a line carries the sent bytes: no reply begins earlier.

A write returns before its bytes have left. A reply that is complete before it can have crossed the
line is a copy of an older one.
"""

import numpy as np

from snakewalk.drivers.clock import Clock, WallClock

_LEAST_SHARE = 0.9
"""Share of the computed time of request and reply: neither clock is off by more (ours)."""
_IN_VAIN = 2
"""Number of replies in a row that look like copies, with nothing behind them, after which the line
counts as faster than its baud rate (ours): some adapters have another rate on their other side."""


class LineReservation:
    """Reservation of one port, shared by all senders; ``paced`` as in ``BytePort``."""

    def __init__(self, clock: Clock, *, paced: bool = False) -> None:
        self._clock = clock
        self._paced = paced
        self._unanswered_count = 0
        self.free_s = np.array([clock.now_s()])
        """(1,) when all that was sent will have left, on the clock, s; compiled code writes it."""
        # the same memory: numpy needs three times as long for a scalar
        self._free_s = self.free_s.data.cast("B").cast("d")

    @property
    def zero_s(self) -> float | None:
        """Zero of the clock in the machine's monotonic time, or None."""
        return self._clock.zero_s if isinstance(self._clock, WallClock) else None

    @property
    def since_sent_s(self) -> float:
        """Time since all sent bytes left the line; 0 before."""
        return max(0.0, self._clock.now_s() - self._free_s[0])

    def reserve(self, wire_s: float) -> float:
        """Note a packet sent now; return the clock time at which all bytes will have left, s."""
        free_s = max(self._clock.now_s(), self._free_s[0]) + wire_s
        self._free_s[0] = free_s
        return free_s

    def has_second_reply(self, free_s: float, request_s: float, reply_s: float) -> bool:
        """Whether a reply that is complete now came too early for the last request.

        The request will have left at ``free_s``.
        """
        late_s = self._clock.now_s() - free_s - reply_s
        return self._paced and late_s < -(1.0 - _LEAST_SHARE) * (request_s + reply_s)

    def note_copies(self, *, answered: bool) -> None:
        """Note repeated replies, and whether the right one came after them."""
        self._unanswered_count = 0 if answered else self._unanswered_count + 1
        self._paced = self._paced and self._unanswered_count < _IN_VAIN
