"""How well the servos follow: error and lag between sent goals and measured positions."""

from typing import Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.topics import CycleTable

_LONGEST_S: Final = 0.6


def tracking_error_rad(cycle: CycleTable) -> Floats:
    """Measured minus sent, (T, J); NaN where a read failed."""
    return np.where(cycle.valid, cycle.measured_rad - cycle.sent_rad, np.nan)


def lag_s(cycle: CycleTable, period_s: float) -> float:
    """Delay that best explains measured by sent: least squares over whole cycles, then a parabola.

    NaN when nothing moves, or when the run is too short.
    """
    is_complete = np.isfinite(cycle.sent_rad).all(axis=1) & np.isfinite(cycle.measured_rad).all(
        axis=1
    )
    if np.count_nonzero(is_complete) < 2:
        return float("nan")
    time = cycle.deadline_s[is_complete]
    grid = np.arange(time[0], time[-1] + 0.5 * period_s, period_s)
    sent = _on_grid(grid, time, cycle.sent_rad[is_complete])
    measured = _on_grid(grid, time, cycle.measured_rad[is_complete])
    most = round(_LONGEST_S / period_s)
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
