"""Connected graphs of states: random graphs, and the graph of [KP] 4.2.1."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from snakewalk.config.arrays import Complexes, Int32s, Ints
from snakewalk.config.errors import InputError


@dataclass(frozen=True, slots=True)
class Graph:
    """A connected simple graph; the neighbours of q are ``indices[indptr[q] : indptr[q + 1]]``.

    Raises:
        InputError: fewer than 2 states, or not connected.

    """

    indptr: Ints
    """(V + 1,) places of the neighbours of each vertex in ``indices``."""
    indices: Ints
    """(2 E,) ascending for each state."""

    def __post_init__(self) -> None:
        if self.states < 2:
            raise InputError("graph: needs 2 states or more")
        parts, part = _parts(self.indptr, self.indices)
        if parts > 1:
            raise InputError(
                f"graph: {self.states} states fall into {parts} parts, the largest of "
                f"{np.bincount(part).max()}; no walk can cover it: join them, or walk one part"
            )

    @property
    def states(self) -> int:
        """Number of nodes V."""
        return len(self.indptr) - 1

    @property
    def degree(self) -> Ints:
        """(V,) number of neighbours."""
        return np.diff(self.indptr)

    @property
    def mean_degree(self) -> float:
        """2 E / V."""
        return len(self.indices) / self.states


def graph_from_edges(states: int, edges: Ints) -> Graph:
    """Build from undirected edges (E, 2); ignore loops and repeated edges.

    Raises:
        InputError: an edge to no state, fewer than 2 states, or not connected.

    """
    if len(edges) and (edges.min() < 0 or edges.max() >= states):
        raise InputError(f"graph: an edge ends outside the states 0 to {states - 1}")
    return Graph(*_lists(states, edges))


def largest_part(states: int, edges: Ints) -> Graph:
    """Build from undirected edges (E, 2); keep the largest connected part, renumbered.

    Raises:
        InputError: the edges are empty.

    """
    if len(edges) == 0:
        raise InputError(f"graph: {states} states without an edge; raise the degree")
    number, part = _parts(*_lists(states, edges))
    largest = part == np.argmax(np.bincount(part, minlength=number))
    name = np.cumsum(largest) - 1
    return graph_from_edges(int(largest.sum()), name[edges[largest[edges[:, 0]]]])


def random_edges(states: int, degree: float, rng: np.random.Generator) -> Ints:
    """Return Erdos-Renyi edges (E, 2) of mean ``degree``."""
    count = int(rng.binomial(states * (states - 1) // 2, degree / (states - 1)))
    keys = np.empty(0, dtype=np.int64)
    while len(keys) < count:
        low, high = np.sort(rng.integers(states, size=(count - len(keys), 2)), axis=1).T
        keys = np.concatenate([keys, (low * states + high)[low < high]])
        keys = keys[np.sort(np.unique(keys, return_index=True)[1])]  # the first draw of each
    return np.stack(np.divmod(keys, states), axis=1)


def small_world_edges(states: int, degree: int, rewired: float, rng: np.random.Generator) -> Ints:
    """Return Watts-Strogatz edges (E, 2): a ring of ``degree`` neighbours, partly rewired.

    If the degree is odd, every second state gets one more edge, to the next distance.
    """
    near = [(q, (q + k) % states) for k in range(1, degree // 2 + 1) for q in range(states)]
    if degree % 2:
        near += [(q, (q + degree // 2 + 1) % states) for q in range(0, states, 2)]
    taken = {frozenset(edge) for edge in near}
    for k, (a, b) in enumerate(near):
        if rng.random() < rewired:
            c = int(rng.integers(states))
            if c != a and frozenset((a, c)) not in taken:
                taken.remove(frozenset((a, b)))
                taken.add(frozenset((a, c)))
                near[k] = (a, c)
    return np.array(near, dtype=np.int64)


def threshold_graph(states: Complexes, threshold: float | None) -> Graph:
    """Join states (S, n) whose Euclidean distance is at most ``threshold`` ([KP] 4.2.1).

    None selects the smallest threshold that joins all states.

    Raises:
        InputError: fewer than 2 states, or not connected; names a sufficient threshold.

    """
    distance = squareform(pdist(np.concatenate([states.real, states.imag], axis=1)))
    # + 1: the spanning tree treats a distance of 0 as a missing edge
    tree = minimum_spanning_tree(distance + 1.0).tocoo()
    needed = distance[tree.row, tree.col].max(initial=0.0)
    limit = needed if threshold is None else threshold
    try:
        return graph_from_edges(len(states), np.argwhere(np.triu(distance <= limit, 1)))
    except InputError as error:
        if len(states) < 2:
            raise
        enough = np.ceil(1e4 * needed) / 1e4  # rounded up: rounded down, it would not join all
        raise InputError(
            f"{error.faults[0]} (threshold {limit:.4g}; {enough:.10g} joins all)"
        ) from None


def _lists(states: int, edges: Ints) -> tuple[Ints, Ints]:
    """(V + 1,) starts and (2 E,) neighbours."""
    both = np.concatenate([edges, edges[:, ::-1]])
    keys = np.unique(both[both[:, 0] != both[:, 1]] @ np.array([states, 1]))
    ends = np.searchsorted(keys, np.arange(states + 1) * states)
    return ends.astype(np.int64), keys % states


def _parts(indptr: Ints, indices: Ints) -> tuple[int, Int32s]:
    """Number of connected parts, and the part (V,) of each state."""
    ones = np.ones(len(indices), dtype=np.int8)
    shape = (len(indptr) - 1, len(indptr) - 1)
    net = csr_array((ones, indices, indptr), shape=shape)
    number, part = connected_components(net, directed=False)
    return int(number), part
