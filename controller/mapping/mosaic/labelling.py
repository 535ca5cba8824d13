"""Discrete labelling of a grid: a Markov random field with Potts terms ([KP] 3.4.1).

A label of a pixel p is a place in its window of the second picture and a scale. Its flow is
``base[p] + offset``. Labels are equal if flow and scale are equal.
"""

import numpy as np

from snakewalk.config.arrays import Floats, Ints, Singles
from snakewalk.drivers.compiling import compiled, readonly_array

Costs = Singles
"""(rows, columns, scales, window, window) data term of each label; infinite outside of SEARCH."""
_COST = readonly_array("float32", dimensions=5, layout="C")
_INTS = readonly_array("int64", dimensions=3, layout="C")
_LABELS = "int64[:, ::1]"


def labelled(costs: Costs, base: Ints, penalty: float, rounds: int = 10) -> Ints:
    """Labels (rows, columns) of low energy, as indices into the last three axes, or -1.

    Costs are aggregated along eight directions; then iterated conditional modes descend.

    Args:
        costs: data terms.
        base: (rows, columns, 2) column and row of the flow at the first place of the window.
        penalty: constant of the Potts term.
        rounds: limit of the rounds of iterated conditional modes.

    """
    total = np.zeros_like(costs)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1)):
        _aggregate(costs, base, down, right, penalty, total)
    labels = cheapest(total)
    descend(costs, base, penalty, rounds, labels)
    return labels


def cheapest(costs: Costs) -> Ints:
    """Labels (rows, columns) of the least data terms, or -1."""
    flat = costs.reshape(*costs.shape[:2], -1)
    return np.where(np.isfinite(flat.min(axis=2)), flat.argmin(axis=2), -1).astype(np.int64)


@compiled(f"void({_COST}, {_INTS}, int64, int64, float64, float32[:, :, :, :, ::1])")
def _aggregate(
    costs: Costs, base: Ints, down: int, right: int, penalty: float, total: Costs
) -> None:
    """Add the least costs of all paths arriving in a direction."""
    rows, columns, scales, high, wide = costs.shape
    path = np.zeros((2, columns, scales, high, wide), np.float32)
    least = np.zeros((2, columns), np.float32)
    for i in range(rows):
        row = i if down >= 0 else rows - 1 - i
        now = i % 2
        before = (i + 1) % 2
        for j in range(columns):
            column = j if right >= 0 else columns - 1 - j
            r, c = row - down, column - right
            from_line = now if down == 0 else before
            starts = r < 0 or r >= rows or c < 0 or c >= columns
            floor = np.float32(0.0)
            if not starts:
                floor = least[from_line, c]
                starts = not np.isfinite(floor)
            lowest = np.float32(np.inf)
            dy = dx = 0
            if not starts:
                dx = base[row, column, 0] - base[r, c, 0]
                dy = base[row, column, 1] - base[r, c, 1]
            for s in range(scales):
                for y in range(high):
                    for x in range(wide):
                        value = costs[row, column, s, y, x]
                        if value < np.inf and not starts:
                            step = np.float32(penalty)
                            v, u = y + dy, x + dx
                            if 0 <= v < high and 0 <= u < wide:
                                step = min(step, path[from_line, c, s, v, u] - floor)
                            value += step
                        path[now, column, s, y, x] = value
                        lowest = min(lowest, value)
                        total[row, column, s, y, x] += value
            least[now, column] = lowest


@compiled(f"void({_COST}, {_INTS}, float64, int64, {_LABELS})")
def descend(costs: Costs, base: Ints, penalty: float, rounds: int, labels: Ints) -> None:  # noqa: C901  a compiled loop
    """Change labels to their conditional modes until none changes; the energy never rises."""
    rows, columns, scales, high, wide = costs.shape
    window = high * wide
    for _ in range(rounds):
        changed = 0
        for row in range(rows):
            for column in range(columns):
                now = labels[row, column]
                if now < 0:
                    continue
                # Without an equal neighbour the label of least cost is best.
                best = now
                lowest = np.inf
                for s in range(scales):
                    for y in range(high):
                        for x in range(wide):
                            value = costs[row, column, s, y, x]
                            if value >= np.inf:
                                continue
                            for side in range(4):
                                r, c = (
                                    row + (side == 0) - (side == 1),
                                    column + (side == 2) - (side == 3),
                                )
                                if r < 0 or r >= rows or c < 0 or c >= columns or labels[r, c] < 0:
                                    continue
                                other = labels[r, c]
                                v = other % window // wide + base[r, c, 1] - base[row, column, 1]
                                u = other % wide + base[r, c, 0] - base[row, column, 0]
                                if other // window != s or v != y or u != x:
                                    value += penalty
                            if value < lowest - 1e-9:
                                best = s * window + y * wide + x
                                lowest = value
                if best != now:
                    labels[row, column] = best
                    changed += 1
        if changed == 0:
            break


def flow_of(costs: Costs, base: Ints, labels: Ints) -> tuple[Floats, Ints]:
    """Flow (rows, columns, 2), NaN without a label, and scale index of labels."""
    window = costs.shape[3] * costs.shape[4]
    wide = costs.shape[4]
    place = np.stack([labels % wide, labels % window // wide], axis=-1) + base
    return np.where(labels[..., None] >= 0, place, np.nan), labels // window
