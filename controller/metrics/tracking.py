"""How well the servos follow: error and lag between sent goals and measured positions."""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.topics import CycleTable

_LONGEST_LAG_S = 0.6
_CYCLES = 50_000
"""Cycles at the end of a run from which the lag is computed (ours): 17 minutes at 50 Hz."""


def tracking_errors(cycle: CycleTable) -> Floats:
    """Measured minus sent in each cycle, without failed reads, (T, 3).

    The columns are the sum of the squares, rad^2, the number of joints, and the largest, rad.
    """

    def errors(valid: Bools, measured_rad: Floats, sent_rad: Floats) -> Floats:
        off_rad = measured_rad - sent_rad
        is_known = valid & np.isfinite(off_rad)
        off_rad = np.abs(np.where(is_known, off_rad, 0.0))
        columns = np.square(off_rad).sum(axis=1), is_known.sum(axis=1), off_rad.max(axis=1)
        return np.stack(columns, axis=1)

    return np.asarray(by_rows(errors, cycle.valid, cycle.measured_rad, cycle.sent_rad))


def lag_s(cycle: CycleTable, period_s: float) -> float:
    """Delay that best explains measured by sent: least squares over whole cycles, then a parabola.

    NaN when nothing moves, or when the run is too short.
    """
    sent_rad = cycle.sent_rad[-_CYCLES:]
    measured_rad = cycle.measured_rad[-_CYCLES:]
    is_complete = np.isfinite(sent_rad).all(axis=1) & np.isfinite(measured_rad).all(axis=1)
    if np.count_nonzero(is_complete) < 2:
        return float("nan")
    time = cycle.deadline_s[-_CYCLES:][is_complete]
    grid = np.arange(time[0], time[-1] + 0.5 * period_s, period_s)
    sent = _on_grid(grid, time, sent_rad[is_complete])
    measured = _on_grid(grid, time, measured_rad[is_complete])
    most = round(_LONGEST_LAG_S / period_s)
    if len(grid) < 3 * most or np.ptp(sent, axis=0).max() < 1e-3:
        return float("nan")
    measured_window = measured[most:]
    cost = np.array(
        [
            np.square(measured_window - sent[most - k : len(sent) - k]).mean()
            for k in range(most + 1)
        ]
    )
    k = int(cost.argmin())
    if 0 < k < most:
        left, mid, right = cost[k - 1 : k + 2]
        return period_s * (k + 0.5 * float((left - right) / (left - 2.0 * mid + right)))
    return period_s * k


def _on_grid(grid: Floats, time: Floats, values: Floats) -> Floats:
    return np.stack([np.interp(grid, time, column) for column in values.T], axis=1)
