"""Whether the loop kept its time, and how full the wire was."""

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.runlog.record import RunRecord


def skipped_cycles(record: RunRecord) -> Ints:
    """Deadlines (T - 1,) that passed without a cycle between each two that were run."""
    steps = np.diff(record.cycle.deadline_s) / record.period_s
    return np.maximum(np.rint(steps).astype(np.int64) - 1, 0)


def wire_use(record: RunRecord) -> Floats:
    """Share (T,) of the period that the wire was busy; NaN where unknown."""
    return record.cycle.wire_busy_s / record.period_s
