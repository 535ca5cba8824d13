"""Scheduled events on a simulated bus."""

import heapq
from collections.abc import Callable


class EventQueue:
    """Actions by time; equal times in scheduling order."""

    def __init__(self) -> None:
        self._scheduled: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0
        self.next_s = float("inf")
        """Time of the first event in the queue."""

    def schedule(self, time_s: float, action: Callable[[], None]) -> None:
        """Run ``action`` at ``time_s``, or at the next ``run_due`` if that is past."""
        heapq.heappush(self._scheduled, (time_s, self._count, action))
        self._count += 1
        self.next_s = self._scheduled[0][0]

    def run_due(self, now_s: float) -> None:
        """Run all due actions."""
        while self._scheduled and self._scheduled[0][0] <= now_s:
            heapq.heappop(self._scheduled)[2]()
        self.next_s = self._scheduled[0][0] if self._scheduled else float("inf")
