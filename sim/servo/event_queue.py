"""Things that happen at a time of their own on a simulated bus."""

import heapq
from collections.abc import Callable


class Agenda:
    """Actions by time, carried out in order; equal times in the order of planning."""

    def __init__(self) -> None:
        self._planned: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0
        self.next_s = float("inf")
        """Time of the first."""

    def plan(self, time_s: float, action: Callable[[], None]) -> None:
        """Do ``action`` at ``time_s``, or at once at the next look if that is past."""
        heapq.heappush(self._planned, (time_s, self._count, action))
        self._count += 1
        self.next_s = self._planned[0][0]

    def carry_out(self, now_s: float) -> None:
        """Do all that is due."""
        while self._planned and self._planned[0][0] <= now_s:
            heapq.heappop(self._planned)[2]()
        self.next_s = self._planned[0][0] if self._planned else float("inf")
