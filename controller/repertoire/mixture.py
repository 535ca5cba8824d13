"""Mixtures: numbers of cycles of several actions, whose mean speed and turn meet a request."""

from itertools import combinations, product

import numpy as np

from snakewalk.config.arrays import Floats, Ints

CYCLES = 10
"""Cycles over which the mean of a mixture is taken (ours)."""
_MOST_ACTIONS = 3
"""Actions of a mixture: three corners enclose every pair of a speed and a turn."""
_TOLERANCE = 0.1
"""Largest error of a mean, as a share of the request (ours)."""
_LEAST_TURN_RAD_S = 0.4
"""A smaller request has the tolerance of this one (ours): about the gentlest recorded turn."""
_COST_OF_ACTION = 0.1
"""Share of the tolerance that an action more in the mixture has to gain (ours)."""


class Mixtures:
    """All mixtures of actions with given speeds and turns (K, 2), and durations (K,).

    A request for a speed below ``least_m_s`` has the tolerance of that speed.
    """

    def __init__(self, rates: Floats, duration_s: Floats, least_m_s: float) -> None:
        self._least = least_m_s, _LEAST_TURN_RAD_S
        actions = len(rates)
        most = min(_MOST_ACTIONS, actions)
        shares = [part for part in product(range(CYCLES + 1), repeat=most) if sum(part) == CYCLES]
        blocks = []
        for chosen in combinations(range(actions), most):
            block = np.zeros((len(shares), actions), dtype=np.int64)
            block[:, chosen] = shares
            blocks.append(block)
        self._cycles: Ints = np.unique(np.concatenate(blocks), axis=0)
        """(M, K) cycles of each action."""
        weight = self._cycles * duration_s
        self._mean: Floats = weight @ rates / weight.sum(axis=1, keepdims=True)
        """(M, 2) mean speeds and turns."""

    def best(self, asked: Floats) -> tuple[Ints, float]:
        """Return the cycles (K,) nearest to a request (2,), and their error over the tolerance."""
        error = self._errors(asked).max(axis=1)
        actions = (self._cycles > 0).sum(axis=1)
        k = int(np.argmin(error + _COST_OF_ACTION * actions))
        return self._cycles[k], float(error[k])

    def span(self, axis: int, asked: Floats) -> Floats:
        """Return the mean speeds (axis 0) or turns (1) of the mixtures that meet the other one."""
        return np.asarray(self._mean[self._errors(asked)[:, 1 - axis] <= 1.0, axis])

    def _errors(self, asked: Floats) -> Floats:
        """(M, 2) differences from a request, over the tolerances."""
        tolerance = _TOLERANCE * np.maximum(np.abs(asked), self._least)
        return np.abs(self._mean - asked) / tolerance
