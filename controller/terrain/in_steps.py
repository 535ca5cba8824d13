"""Calculations in steps, so that each control cycle does a bounded part.

A generator yields the size of each step before the step, and returns the result. The unit is about
a microsecond on a processor of 2020. No clock is read, so the steps are the same on every machine.
"""

from collections.abc import Generator
from typing import Generic, TypeAlias, TypeVar

T = TypeVar("T")
Steps: TypeAlias = Generator[int, None, T]


def at_once(steps: Steps[T]) -> T:
    """Run a calculation to its end and return the result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


class Unfinished(Generic[T]):
    """A calculation in progress."""

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps
        self._waiting: int | None = None
        self.largest = 0
        """Units done in the call of ``carry_on`` that did most."""
        self.result: T | None = None
        """Result of the work; None until it is done."""

    def carry_on(self, budget: int) -> bool:
        """Do the next step, and more within ``budget`` units; return whether it is done.

        Raises:
            InputError: from the calculation.

        """
        spent = 0
        while self._waiting is None or spent == 0 or spent + self._waiting <= budget:
            spent += self._waiting or 0
            self.largest = max(self.largest, spent)
            try:
                self._waiting = max(1, next(self._steps))
            except StopIteration as end:
                self.result = end.value
                return True
        return False
