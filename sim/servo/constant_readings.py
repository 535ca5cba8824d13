"""Constant readings: registers of a dead sensor."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ConstantReadings:
    """Values that registers of some servos show instead of the measured ones."""

    def __init__(self, view: Callable[[str], NDArray[np.integer[Any]]]) -> None:
        """Start empty; ``view`` returns the live view (S,) of a register."""
        self._view = view
        self._values: dict[str, dict[int, int]] = {}

    @property
    def any(self) -> bool:
        """Whether there are constant readings."""
        return bool(self._values)

    def set(self, rows: NDArray[np.intp], name: str, value: int | None) -> None:
        """Show a value in a register of servos; None: the present one."""
        shown = self._view(name)
        by_row = self._values.setdefault(name, {})
        by_row |= {row: int(shown[row]) if value is None else value for row in rows.tolist()}

    def clear(self, rows: NDArray[np.intp], name: str) -> None:
        """Show measured values in a register of servos again."""
        by_row = self._values.get(name, {})
        for row in rows.tolist():
            by_row.pop(row, None)
        if not by_row:
            self._values.pop(name, None)

    def apply(self) -> None:
        """Write the values into the registers."""
        for name, by_row in self._values.items():
            self._view(name)[list(by_row)] = list(by_row.values())
