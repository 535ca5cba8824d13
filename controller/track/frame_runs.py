"""Runs of consecutive frames, and missing frames."""

import numpy as np

from snakewalk.config.arrays import Floats, Ints

LEAST_ROWS = 8
"""Rows from which a common step of frame numbers is a rule and not chance (ours)."""

_REGULAR_SHARE = 0.8
"""Part of the steps that are alike in a table of every n-th frame with exceptions (ours)."""


def consecutive(number: Ints) -> list[Ints]:
    """Indices of consecutive frames, run by run."""
    return np.split(np.arange(len(number)), np.flatnonzero(np.diff(number) != 1) + 1)


def missing_frames(number: Ints) -> int:
    """Number of frames missing between the first and the last number (T,)."""
    return int(number[-1] - number[0]) + 1 - len(number) if len(number) else 0


def common_step(number: Ints) -> int:
    """Frames from row to row if a file lists every n-th frame; else 1."""
    if len(number) < LEAST_ROWS:
        return 1
    return max(1, int(np.gcd.reduce(np.diff(number))))


def is_mostly_every_nth(number: Ints) -> bool:
    """Whether most rows, but not all, are the same number of frames above 1 apart."""
    if len(number) < LEAST_ROWS:
        return False
    step = np.diff(number)
    usual = float(np.median(step))
    return usual > 1.0 and float((step == usual).mean()) >= _REGULAR_SHARE


def bridged(number: Ints, values: Floats, most: int) -> list[tuple[Ints, Floats]]:
    """Numbers and values (T', N) of runs; gaps of up to ``most`` frames are interpolated."""
    runs = np.split(np.arange(len(number)), np.flatnonzero(np.diff(number) > most + 1) + 1)
    filled = []
    for run in runs:
        every = np.arange(number[run[0]], number[run[-1]] + 1)
        columns = [np.interp(every, number[run], column) for column in values[run].T]
        filled.append((every, np.stack(columns, axis=1)))
    return filled
