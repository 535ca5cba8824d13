"""Dijkstra's algorithm on a graph of arcs, in steps."""

import numpy as np

from snakewalk.config.arrays import Floats, Indices, Ints
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.drivers.compiling import compiled

_SETTLED_IN_STEP = 1500
"""Nodes whose distance becomes final in a step; each has up to sixteen arcs."""
_UNITS = 1000


def shortest_tree(
    starts: Ints, ends: Ints, weights: Floats, source: int
) -> Steps[tuple[Floats, Indices]]:
    """Return the shortest distances from a node to all others.

    Args:
        starts: (n + 1,) index of the first arc of each node, then the number of arcs.
        ends: (m,) node at the end of each arc.
        weights: (m,) lengths of the arcs, 0 or more.
        source: node.

    Returns:
        Distances (n,), infinite if unreachable, and the previous node (n,), or -9999.

    """
    count = len(starts) - 1
    distance = np.full(count, np.inf)
    before = np.full(count, -9999, np.int64)
    keys = np.empty(len(ends) + 1)
    nodes = np.empty(len(ends) + 1, np.int64)
    settled = np.zeros(count, np.bool_)
    size = np.array([1])
    distance[source], keys[0], nodes[0] = 0.0, 0.0, source
    while size[0] > 0:
        yield _UNITS
        _settle(starts, ends, weights, distance, before, settled, keys, nodes, size)
    return distance, before.astype(np.intp)


@compiled(
    "void(int64[::1], int64[::1], float64[::1], float64[::1], int64[::1], boolean[::1],"
    " float64[::1], int64[::1], int64[::1])",
    makes_arrays=False,
)
def _settle(
    starts: Ints,
    ends: Ints,
    weights: Floats,
    distance: Floats,
    before: Ints,
    settled: np.ndarray[tuple[int], np.dtype[np.bool_]],
    keys: Floats,
    nodes: Ints,
    size: Ints,
) -> None:
    """Settle the next nodes; ``keys`` and ``nodes`` are a binary heap with ``size[0]`` entries."""
    done = 0
    n = size[0]
    while n > 0 and done < _SETTLED_IN_STEP:
        node = nodes[0]
        n -= 1
        key = keys[n]
        moved = nodes[n]
        slot = 0
        while 2 * slot + 1 < n:  # sift the last entry down from the top
            child = 2 * slot + 1
            if child + 1 < n and keys[child + 1] < keys[child]:
                child += 1
            if keys[child] >= key:
                break
            keys[slot], nodes[slot] = keys[child], nodes[child]
            slot = child
        keys[slot], nodes[slot] = key, moved
        if settled[node]:
            continue
        settled[node] = True
        done += 1
        for arc in range(starts[node], starts[node + 1]):
            end = ends[arc]
            length = distance[node] + weights[arc]
            if length < distance[end]:
                distance[end], before[end] = length, node
                slot = n
                n += 1
                while slot > 0 and keys[(slot - 1) // 2] > length:
                    keys[slot], nodes[slot] = keys[(slot - 1) // 2], nodes[(slot - 1) // 2]
                    slot = (slot - 1) // 2
                keys[slot], nodes[slot] = length, end
    size[0] = n
