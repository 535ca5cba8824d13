"""Layout of the table of links that the compiled balances of friction read."""

import numpy as np

from snakewalk.config.arrays import Floats

GRIP = "UniTuple(float64, 4)"
"""Numba's type of ``FrictionConfig.grip``."""
LANES = 8
"""Number of links side by side in a table, which the processor handles at once."""
POINT_X, POINT_Y, FORWARD_X, FORWARD_Y, SHAPE_X, SHAPE_Y = range(0, 6 * LANES, LANES)
"""Where rows of a table begin: a link's centre, the unit vector along it, its velocity relative to
the body frame."""
NORMAL, MOVING_X, MOVING_Y = range(6 * LANES, 9 * LANES, LANES)
"""A link's load, and how it moved in the step before."""
OTHERS = 34 * LANES
"""First row that is free for other users of the table."""


def link_table(links: int, rows: int = OTHERS) -> Floats:
    """Zeros (n,) for a table of ``links`` links with ``rows`` numbers per group.

    Groups have ``LANES`` links: number ``k`` of a row that begins at ``ROW`` is at ``k // LANES *
    rows + ROW + k % LANES``. Places beyond the last link stay zero and bear nothing.
    """
    return np.zeros(-(-links // LANES) * rows)
