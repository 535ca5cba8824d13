"""One line of a benchmark's table, and how CPU time is taken."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One measured value beside what it is compared with."""

    what: str
    value: float
    unit: str
    against: str = ""
    """What ``ratio`` is relative to; empty where there is no comparison."""
    ratio: float = float("nan")
    target: float | None = None
    """Largest ratio that is wanted; None: the row only informs."""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without one."""
        return None if self.target is None else self.ratio <= self.target


def cpu_s(work: Callable[[], object], times: int, tries: int = 5) -> float:
    """CPU time of one call of ``work``, s: best mean of ``times`` calls in ``tries`` tries."""
    work()
    best = float("inf")
    for _ in range(tries):
        start = time.process_time()
        for _ in range(times):
            work()
        best = min(best, (time.process_time() - start) / times)
    return best
