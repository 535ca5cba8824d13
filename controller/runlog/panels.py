"""Curves of a run over time, as the topics describe them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.column import Curve, Panel, Table
from snakewalk.controller.runlog.record import RunRecord


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
        return flat is not None and float(np.ptp(self._known)) <= flat

    @property
    def constant_text(self) -> str:
        """Words for a constant curve."""
        curve = self.curve
        median = f"{curve.name} {np.median(self._known):.1f} {curve.panel.unit}".rstrip()
        return curve.constant or median

    @property
    def _known(self) -> Floats:
        return self.values[np.isfinite(self.values)]


def panel_curves(record: RunRecord, panel: Panel) -> list[CurveValues]:
    """Curves of a panel that have a value at any time."""
    return [curve for curve in _curves(record, panel) if np.isfinite(curve.values).any()]


def _curves(record: RunRecord, panel: Panel) -> Iterator[CurveValues]:
    for table in record.tables():
        for name, column in table.topic.columns.items():
            for curve in column.curves:
                if curve.panel == panel:
                    yield CurveValues(curve, table.time_s, _values(table, name, curve))


def _values(table: Table, name: str, curve: Curve) -> Floats:
    values = curve.scale * np.asarray(getattr(table, name), dtype=float)
    if curve.gaps:
        values = np.where(getattr(table, curve.gaps), values, np.nan)
    if curve.magnitude:
        values = np.abs(values)
    if not curve.joints:
        return values
    reduced = np.full(len(values), np.nan)
    is_known = np.isfinite(values).any(axis=1)
    some = values[is_known]
    match curve.joints:
        case "largest":
            reduced[is_known] = np.nanmax(some, axis=1)
        case "least":
            reduced[is_known] = np.nanmin(some, axis=1)
        case "mean":
            reduced[is_known] = np.nanmean(some, axis=1)
    return reduced
