"""Missing replies: they may still arrive, and must not count as new.

A status packet has the servo's ID and its length, but not the request. So a reply belongs to the
present request only if no older request for that length is pending.
"""

from collections.abc import Iterable

from snakewalk.drivers.clock import Clock

HORIZON_S = 0.5
"""Largest delay of a reply (ours)."""
SPARE_LENGTHS = 16


class PendingReplies:
    """Pending replies of all servos on one port."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        # servo, fast, length -> time until which such a reply may arrive; may hold expired entries
        self._until_s: dict[tuple[int, bool, int], float] = {}
        self._last_s = 0.0

    @property
    def empty(self) -> bool:
        """Whether no reply is pending; drops the entries once all have expired."""
        if self._until_s and self._clock.now_s() >= self._last_s:
            self._until_s.clear()
        return not self._until_s

    def add(self, servo_ids: Iterable[int], length: int, *, fast: bool) -> None:
        """Note that replies of ``length`` bytes did not arrive."""
        self._last_s = self._clock.now_s() + HORIZON_S
        for servo_id in servo_ids:
            self._until_s[servo_id, fast, length] = self._last_s

    def is_pending(self, servo_id: int, length: int, *, fast: bool) -> bool:
        """Whether a reply of ``length`` bytes may be a late one."""
        until_s = self._until_s.get((servo_id, fast, length))
        return until_s is not None and self._clock.now_s() < until_s

    def free_length(
        self, servo_ids: Iterable[int], shortest: int, *, fast: bool, spares: int = SPARE_LENGTHS
    ) -> int:
        """Shortest reply length that no servo has pending; ``shortest`` if all do."""
        ids = tuple(servo_ids)
        for length in range(shortest, shortest + spares):
            if not any(self.is_pending(servo_id, length, fast=fast) for servo_id in ids):
                return length
        return shortest
