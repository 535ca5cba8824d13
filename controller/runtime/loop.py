"""The control loop: absolute deadlines, a late cycle is skipped and never made up in a burst."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from snakewalk.drivers.clock import Clock


class Tick(NamedTuple):
    """One turn of the loop."""

    number: int
    """Multiple of the period since the start; a jump of more than one is a skip."""
    deadline_s: float
    lateness_s: float
    skipped: int


def ticks(clock: Clock, period_s: float, until_s: float | Callable[[], float]) -> Iterator[Tick]:
    """Yield at ``start + n period`` until ``until_s``; after a stall go on at the next deadline.

    An end that may be put off is a function, asked in every turn.

    Raises:
        ValueError: the period is not positive.

    """
    if not period_s > 0.0:
        raise ValueError(f"period_s must be positive, got {period_s}")
    start_s = clock.now_s()
    number = 0
    skipped = 0
    end_s = until_s if callable(until_s) else lambda: until_s
    while True:
        deadline_s = start_s + number * period_s
        if deadline_s > end_s():
            return
        clock.sleep_until_s(deadline_s)
        yield Tick(number, deadline_s, clock.now_s() - deadline_s, skipped)
        due = int((clock.now_s() - start_s) / period_s) + 1
        skipped = max(0, due - (number + 1))
        number = max(number + 1, due)
