"""Coordinate search: each parameter in turn, a leap along the improvement, smaller steps.

[TH] 3.3.3 changes position and head angle on a grid of 3 px and 3 degrees, then of 1, then the
spine angles in turn; the leap is that of Hooke and Jeeves.
"""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Floats


def pattern_search(
    value: Callable[[Floats], float],
    start: Floats,
    steps: Floats,
    *,
    halvings: int,
    evaluations: int = 600,
) -> tuple[Floats, float]:
    """Largest ``value`` near ``start``.

    Args:
        value: to be made large; -inf where it has no meaning.
        start: (P,) where to begin.
        steps: (P,) first steps; 0 keeps a parameter as it is.
        halvings: how often the steps are halved when none of them helps.
        evaluations: after this number of evaluations no new round begins.

    Returns:
        The best parameters and their value, never less than at ``start``.

    """
    used = 0

    def score(point: Floats) -> float:
        nonlocal used
        used += 1
        return value(point)

    def explore(point: Floats, best: float, size: Floats) -> tuple[Floats, float]:
        point = point.copy()
        for k in np.flatnonzero(size):
            coordinate = point[k]
            for sign in (1.0, -1.0):
                point[k] = coordinate + sign * size[k]
                trial_value = score(point)
                if trial_value > best:
                    best = trial_value
                    break
                point[k] = coordinate
        return point, best

    point = np.array(start, dtype=float)
    best = score(start)
    size = np.array(steps, dtype=float)
    for _ in range(halvings + 1):
        while used < evaluations:
            there, trial_cost = explore(point, best, size)
            if trial_cost <= best:
                break
            while trial_cost > best and used < evaluations:
                jump_point = there + (there - point)
                point = there
                best = trial_cost
                there, trial_cost = explore(jump_point, score(jump_point), size)
        size *= 0.5
    return point, best
