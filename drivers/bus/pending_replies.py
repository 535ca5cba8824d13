"""Answers that were asked for and have not come: they may still come, and must not pass for new.

A status packet says who speaks and how long it is, not what was asked. So an answer is known to be
that to the present question only if no older question that it would fit is still open. For each
servo this remembers the lengths that are open, for as long as an answer can be late; whoever asks
takes a length that is not (a few bytes more than needed), and does not believe one that is.
"""

from collections.abc import Iterable

from snakewalk.drivers.clock import Clock

HORIZON_S = 0.5
"""Longest lateness reckoned with; a state grows too old, and the run is stopped, long before."""
SPARE_LENGTHS = 16


class Debts:
    """Open answers of all servos of one port."""

    def __init__(self, clock: Clock, horizon_s: float = HORIZON_S) -> None:
        self._clock = clock
        self._horizon_s = horizon_s
        # servo, fast, length -> until when such an answer may come; may hold what is too old
        self._owed: dict[tuple[int, bool, int], float] = {}
        self._last_s = 0.0

    @property
    def none(self) -> bool:
        """Whether nothing is open; forgets what is too old."""
        if self._owed and self._clock.now_s() >= self._last_s:
            self._owed.clear()
        return not self._owed

    def owe(self, servo_ids: Iterable[int], length: int, *, fast: bool) -> None:
        """Note that answers of ``length`` bytes have not come."""
        self._last_s = self._clock.now_s() + self._horizon_s
        for servo_id in servo_ids:
            self._owed[servo_id, fast, length] = self._last_s

    def open(self, servo_id: int, length: int, *, fast: bool) -> bool:
        """Whether an answer of ``length`` bytes may be an old one."""
        until_s = self._owed.get((servo_id, fast, length))
        return until_s is not None and self._clock.now_s() < until_s

    def free_length(self, servo_ids: Iterable[int], shortest: int, *, fast: bool) -> int:
        """Least length from ``shortest`` on that none of the servos has open; it, if all are."""
        ids = tuple(servo_ids)
        for length in range(shortest, shortest + SPARE_LENGTHS):
            if not any(self.open(servo_id, length, fast=fast) for servo_id in ids):
                return length
        return shortest
