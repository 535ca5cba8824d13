"""W on a star: the next state where every other state is a leaf ([PT] 2.6.2, Eq. 4-7).

Every leaf has degree 1, so W only orders by: unvisited; then F = 0 with fewest M; then the smallest
M 2^F. Here F counts the times that a state was left for an already *visited* one (METHOD 3).
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def star_order(
    M: Integers, F: Integers, last_visit: Integers, heading_error: Floats
) -> NDArray[np.intp]:
    """Order candidates, best first: (V,) indices.

    Args:
        M: (V,) times that each was selected.
        F: (V,) times that each was left for an already visited one.
        last_visit: (V,) step of the last selection, any negative number for never.
        heading_error: (V,) rad, decides ties by its size; then the least recently visited leads.

    """
    group, exponent, mantissa = _load(M, F)
    return np.lexsort((last_visit, np.abs(heading_error), mantissa, exponent, group))


def star_best(M: Integers, F: Integers, last_visit: Integers, heading_error: Floats) -> int:
    """First of ``star_order`` in O(V): a few passes, each over what is still tied.

    Raises:
        ValueError: no candidates.

    """
    if len(M) == 0:
        raise ValueError("a star without leaves has no next state")
    group, exponent, mantissa = _load(M, F)
    tied = np.flatnonzero(group == group.min())
    for key in (exponent, mantissa, np.abs(heading_error), last_visit):
        value = key[tied]
        tied = tied[value == value.min()]
    return int(tied[0])


def _load(M: Integers, F: Integers) -> tuple[Integers, Integers, Floats]:
    """Class 0..2, and M 2^F as exponent and mantissa: exact, where 2^F itself overflows."""
    group = np.where(M == 0, 0, np.where(F == 0, 1, 2))
    mantissa, exponent = np.frexp(M.astype(float))
    return group, exponent + F, mantissa
