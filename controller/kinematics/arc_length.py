"""Length along a line of points."""

import numpy as np

from snakewalk.config.arrays import Floats


def arc_lengths(line: Floats) -> Floats:
    """(P,) length of a line (P, 2) up to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
