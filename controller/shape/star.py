"""W on a star: the next state where every other state is a leaf ([PT] 2.6.2, Eq. 4-7).

Every leaf has degree 1, so W orders states: unvisited; then F = 0, fewest M first; then smallest M
2^F. F counts how often a state was left for a *visited* one. The star is rebuilt at each step, so M
may exceed deg + F, and the printed W would then break these classes. This module keeps the classes.
"""

from collections.abc import Iterator

import numpy as np

from snakewalk.config.arrays import Floats, Ints


class StarVisits:
    """Visits of a walk on a star of V states: M, F and the order."""

    def __init__(self, count: int) -> None:
        if count == 0:
            raise ValueError("the walk needs at least one shape")
        self._visits = np.zeros(count, dtype=np.int64)
        self._failures = np.zeros(count, dtype=np.int64)
        self.taken = [0]
        """States in the order in which they were taken; the walk begins on state 0."""
        self._visits[0] = 1

    @property
    def distinct(self) -> int:
        """States taken at least once."""
        return int(np.count_nonzero(self._visits))

    def take(self, state: int) -> None:
        """Move to a state; moving to a visited state counts in F of the state left."""
        if self._visits[state]:
            self._failures[self.taken[-1]] += 1
        self._visits[state] += 1
        self.taken.append(state)

    def order(
        self, error_rad: Floats, tolerance_rad: float, nearest_count: int, rest: int = 1
    ) -> tuple[Iterator[int], int]:
        """Return candidates, best first, and the number of headings within the tolerance.

        Args:
            error_rad: (V,) heading error of each state, if it came next.
            tolerance_rad: largest heading error of a candidate.
            nearest_count: number of candidates if no state is within the tolerance.
            rest: number of last states to exclude.

        """
        size = np.abs(error_rad)
        if rest < len(size):
            size[self.taken[-rest:]] = np.inf
        near = np.flatnonzero(size <= tolerance_rad)
        pool = near if len(near) else np.argsort(size, kind="stable")[:nearest_count]
        ranks = star_order(self._visits[pool], self._failures[pool], error_rad[pool])
        return (int(pool[k]) for k in ranks), len(near)


def star_order(M: Ints, F: Ints, heading_error_rad: Floats) -> Iterator[int]:
    """Yield candidates, best first; the first costs O(V), the others a sort.

    Args:
        M: (V,) times that each was selected.
        F: (V,) times that each was left for a visited one.
        heading_error_rad: (V,) the smallest size decides ties.

    Raises:
        ValueError: no candidates.

    """
    if len(M) == 0:
        raise ValueError("a star without leaves has no next state")
    yield _best_state(M, F, heading_error_rad)
    group = np.where(M == 0, 0, np.where(F == 0, 1, 2))
    mantissa, exponent = np.frexp(M)  # M 2^F in two parts, because 2^F overflows
    order = np.lexsort((np.abs(heading_error_rad), mantissa, exponent + F, group))
    yield from order[1:].tolist()


def _best_state(M: Ints, F: Ints, heading_error_rad: Floats) -> int:
    tied = np.flatnonzero(M == 0)
    if len(tied) == 0:
        tied = np.flatnonzero(F == 0)
        if len(tied):
            tied = tied[M[tied] == M[tied].min()]
        else:
            mantissa, exponent = np.frexp(M)
            exponent = exponent + F
            tied = np.flatnonzero(exponent == exponent.min())
            tied = tied[mantissa[tied] == mantissa[tied].min()]
    return int(tied[np.argmin(np.abs(heading_error_rad[tied]))])
