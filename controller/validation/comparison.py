"""Rows of measurements, played in the simulator."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal

from snakewalk.config.errors import InputError
from snakewalk.controller.validation.benches import simulate
from snakewalk.controller.validation.measurement import (
    Kind,
    MeasuredRow,
    PublishedResults,
    is_near,
)

State = Literal["ok", "reported", "outside", "failed"]
SHOWN = {
    "head_speed_m_s": ("head speed", "cm/s", 100.0),
    "tail_speed_m_s": ("tail speed", "cm/s", 100.0),
    "speed_m_s": ("speed", "cm/s", 100.0),
    "lengths_per_cycle": ("lengths a cycle", "", 1.0),
    "lag_s": ("lag", "ms", 1000.0),
    "rms_error_rad": ("RMS error", "rad", 1.0),
    "no_load_rpm": ("no load", "rev/min", 1.0),
    "stall_torque_n_m": ("stall", "N m", 1.0),
    "stall_current_a": ("stall", "A", 1.0),
}
"""Name, unit and factor of each quantity in tables."""


@dataclass(frozen=True, slots=True)
class Compared:
    """A row with its simulated result."""

    file: str
    row: str
    title: str
    quantity: str
    over: str | None
    """MeasuredRow that divides both results."""
    kind: Kind
    travels: bool
    """Whether a body moves over the ground or through water."""
    measured: float
    sd: float | None
    simulated: float | None
    """Simulated value; None if the simulation failed."""
    range: tuple[float, float]
    cause: str
    """Most likely cause of a ratio far from 1, or why the simulation failed."""

    @property
    def ratio(self) -> float:
        """Simulated over measured; NaN if the simulation failed."""
        return math.nan if self.simulated is None else self.simulated / self.measured

    @property
    def state(self) -> State:
        """``ok``: near 1; ``reported``: in its stated range only; ``outside`` of it."""
        if self.simulated is None:
            return "failed"
        if not self.range[0] <= self.ratio <= self.range[1]:
            return "outside"
        return "ok" if is_near(self.ratio) else "reported"

    @property
    def counts(self) -> bool:
        """Whether the median counts it: measured, of a body that travels, and not fitted.

        A quotient of two rows does not count: both rows count themselves.
        """
        is_comparable = self.over is None and math.isfinite(self.ratio)
        return self.kind == "measured" and self.travels and is_comparable


def compare(
    files: Sequence[tuple[str, PublishedResults]], on_row: Callable[[], None] = lambda: None
) -> list[Compared]:
    """Play all rows; rows with the same conditions share a simulation."""
    rows = []
    for name, measurement in files:
        results = _Results(name, measurement)
        for row in measurement.rows:
            rows.append(results.compared(row))
            on_row()
    return rows


def median_ratio(rows: Sequence[Compared]) -> tuple[float, int]:
    """Median ratio of the rows that count, and their number; NaN without rows."""
    ratios = [row.ratio for row in rows if row.counts]
    return (median(ratios) if ratios else math.nan), len(ratios)


class _Results:
    """Simulated results of one file."""

    def __init__(self, name: str, measurement: PublishedResults) -> None:
        self._name = name
        self._measurement = measurement
        self._played: dict[str, dict[str, float]] = {}

    def compared(self, row: MeasuredRow) -> Compared:
        measured = row.value
        simulated = None
        cause = self._measurement.cause(row)
        travels = False
        try:
            conditions = self._measurement.conditions(row, self._name)
            travels = conditions.travels
            simulated = self._simulated_value(row)
            if row.over is not None:
                other = self._measurement.row(row.over)
                measured /= other.value
                simulated /= self._simulated_value(other)
        except InputError as error:
            cause = str(error)
            simulated = None
        return Compared(
            file=self._name,
            row=row.name,
            title=self._measurement.title,
            quantity=row.quantity,
            over=row.over,
            kind=row.kind,
            travels=travels,
            measured=measured,
            sd=row.sd,
            simulated=simulated,
            range=row.range,
            cause=cause,
        )

    def _simulated_value(self, row: MeasuredRow) -> float:
        conditions = self._measurement.conditions(row, self._name)
        conditions_json = conditions.model_dump_json()
        if conditions_json not in self._played:
            self._played[conditions_json] = simulate(conditions)
        results = self._played[conditions_json]
        if row.quantity not in results:
            raise InputError(
                f"{self._name}: {row.name}: quantity = {row.quantity}: this motion gives "
                f"{', '.join(results)}; choose one of them"
            )
        return results[row.quantity]
