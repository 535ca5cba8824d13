"""One line of a benchmark's table, how CPU time is taken, and the table of what was found."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table


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


def found_table(within: Mapping[str, int], off: Sequence[Sequence[float]]) -> Table:
    """A row for each planted number.

    Args:
        within: how often each was inside its interval.
        off: a row a seed: how far each was off, as a share.

    """
    table = Table("", "inside its interval", "off, median", "off, most", box=None)
    for (name, count), column in zip(within.items(), np.array(off).T, strict=True):
        told = f"{count} of {len(off)}", f"{np.median(column):.1%}", f"{column.max():.1%}"
        table.add_row(name, *told)
    return table
