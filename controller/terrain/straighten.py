"""Straight pieces instead of a grid's staircase: the cheapest polygon through a way's own nodes."""

import numpy as np
from numpy.typing import NDArray

from controller.terrain.safe_graph import SafeGraph

Floats = NDArray[np.float64]

_REACH = 14  # nodes a straight piece may skip; also the whole leg at once is tried
_CORNER_M = 0.3  # what a corner costs, as metres of path: few corners make wide bends


def straighten(way_m: Floats, graph: SafeGraph) -> Floats:
    """(k, 2) corners of the cheapest safe polygon from the first to the last of (m, 2) points.

    Consecutive points of the way are taken to be joined; any other piece must be safe all along.
    """
    last = len(way_m) - 1
    pairs = [(i, j) for j in range(1, last + 1) for i in range(max(0, j - _REACH), j)]
    if last > _REACH:
        pairs.append((0, last))
    a, b = np.array(pairs).T
    price, safe = graph.price(way_m[a], way_m[b])
    price = np.where(safe | (b - a == 1), price, np.inf) + _CORNER_M * graph.length_weight
    best, back = np.full(last + 1, np.inf), np.zeros(last + 1, dtype=int)
    best[0] = 0.0
    for i, j, cost in zip(a.tolist(), b.tolist(), price.tolist(), strict=True):
        if best[i] + cost < best[j]:
            best[j], back[j] = best[i] + cost, i
    corners = [last]
    while corners[-1] != 0:
        corners.append(int(back[corners[-1]]))
    return way_m[corners[::-1]]
