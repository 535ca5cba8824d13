"""Lag and error of known signals."""

import dataclasses

import numpy as np
import pytest

from snakewalk.controller.metrics.tracking import lag_s, tracking_errors
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import CycleTable

PERIOD_S = 0.02


def with_signals(cycle: CycleTable, delay_s: float, keep: np.ndarray | None = None) -> CycleTable:
    """Replace what was sent by sines and what was measured by the same, later."""
    time = np.arange(500) * PERIOD_S
    rows = np.arange(500) if keep is None else np.flatnonzero(keep)
    phase = np.arange(16) * 0.4
    sent = np.sin(3.0 * time[:, None] - phase)
    measured = np.sin(3.0 * (time[:, None] - delay_s) - phase)
    return dataclasses.replace(
        cycle,
        deadline_s=time[rows],
        sent_rad=sent[rows],
        measured_rad=measured[rows],
        valid=np.ones((len(rows), 16), dtype=bool),
    )


@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.034, 0.1, 0.215])
def test_lag_of_a_delayed_sine(record: RunRecord, delay_s: float) -> None:
    cycle = with_signals(record.cycle, delay_s)
    assert lag_s(cycle, PERIOD_S) == pytest.approx(delay_s, abs=5e-4)


def test_lag_survives_missed_cycles(record: RunRecord) -> None:
    keep = np.ones(500, dtype=bool)
    keep[[40, 41, 42, 200, 333]] = False
    assert lag_s(with_signals(record.cycle, 0.06, keep), PERIOD_S) == pytest.approx(0.06, abs=1e-3)


def test_no_lag_without_motion(record: RunRecord) -> None:
    still = dataclasses.replace(with_signals(record.cycle, 0.06), sent_rad=np.ones((500, 16)) * 0.3)
    assert np.isnan(lag_s(still, PERIOD_S))


def test_error_leaves_out_failed_reads(record: RunRecord) -> None:
    cycle = with_signals(record.cycle, 0.06)
    valid = cycle.valid.copy()
    valid[7, 3] = False
    squares, count, error = tracking_errors(dataclasses.replace(cycle, valid=valid)).T
    assert np.argwhere(count != 16).tolist() == [[7]]
    assert count[7] == 15
    assert (squares <= count * error**2 + 1e-12).all()
    largest = 2.0 * np.sin(0.5 * 3.0 * 0.06)  # of sin(a) - sin(a - d)
    assert error.max() == pytest.approx(largest, rel=1e-3)
