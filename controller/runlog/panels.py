"""Curves of a run over time, as the topics describe them."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.runlog.column import Curve, Panel, by_rows
from snakewalk.controller.runlog.record import RunRecord

_REDUCE: Mapping[str, Callable[..., Floats]] = {
    "largest": np.nanmax,
    "least": np.nanmin,
    "mean": np.nanmean,
}


class CurveValues(NamedTuple):
    """A curve of a record."""

    curve: Curve
    time_s: Floats
    """(T,) times of the curve, s."""
    values: Floats
    """(T,) in the panel's unit; (T, J) if the panel shows one joint. NaN is a gap."""

    @property
    def is_constant(self) -> bool:
        """Whether the known values stay within the span that the curve names as flat."""
        flat = self.curve.flat
        return flat is not None and float(np.ptp(self._known_steps)) <= flat

    @property
    def constant_text(self) -> str:
        """Words for a constant curve."""
        curve = self.curve
        median = f"{curve.name} {np.median(self._known_steps):.1f} {curve.panel.unit}".rstrip()
        return curve.constant or median

    @property
    def _known_steps(self) -> Floats:
        return self.values[np.isfinite(self.values)]


def panel_curves(record: RunRecord, panel: Panel, step: int = 1) -> list[CurveValues]:
    """Curves of a panel that have a value at any time, of every ``step``-th row."""
    return [curve for curve in _curves(record, panel, step) if np.isfinite(curve.values).any()]


def _curves(record: RunRecord, panel: Panel, step: int) -> Iterator[CurveValues]:
    for table in record.tables():
        for name, column in table.topic.columns.items():
            for curve in column.curves:
                if curve.panel == panel:
                    columns = [getattr(table, key)[::step] for key in (name, curve.gaps) if key]
                    values = by_rows(partial(_values, curve), *columns)
                    yield CurveValues(curve, table.time_s[::step], values)


def _values(curve: Curve, column: Floats, is_known: Bools | None = None) -> Floats:
    values = curve.scale * np.asarray(column, dtype=float)
    if is_known is not None:
        values = np.where(is_known, values, np.nan)
    if curve.magnitude:
        values = np.abs(values)
    if not curve.joints:
        return values
    reduced = np.full(len(values), np.nan)
    rows = np.isfinite(values).any(axis=1)
    reduced[rows] = _REDUCE[curve.joints](values[rows], axis=1)
    return reduced
