"""Graphs of states, stored as neighbour lists in two arrays: random ones and those of shapes."""

from collections.abc import Iterable
from dataclasses import dataclass

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from config.errors import InputError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
_SPEC = "expected er:STATES:DEGREE or ws:STATES:DEGREE:REWIRED, as er:1000:9 or ws:1000:6:0.1"


@dataclass(frozen=True, slots=True)
class Graph:
    """A connected simple graph; the neighbours of q are ``indices[indptr[q] : indptr[q + 1]]``."""

    indptr: Integers
    """(V + 1,)"""
    indices: Integers
    """(2 E,)"""

    @property
    def states(self) -> int:
        """Number of nodes V."""
        return len(self.indptr) - 1

    @property
    def degree(self) -> Integers:
        """(V,) neighbours of each state."""
        return np.diff(self.indptr)

    @property
    def mean_degree(self) -> float:
        """2 E / V."""
        return len(self.indices) / self.states


def graph_from_edges(states: int, edges: Iterable[tuple[int, int]]) -> Graph:
    """Build from undirected edges; loops and repeated edges are left out.

    Raises:
        InputError: fewer than 2 states, an edge to none of them, or not connected.

    """
    net: nx.Graph[int] = nx.Graph()
    net.add_nodes_from(range(states))
    net.add_edges_from((a, b) for a, b in edges if a != b)
    if states < 2 or len(net) != states:
        raise InputError(f"graph: needs at least 2 states, and edges between 0 and {states - 1}")
    parts = nx.number_connected_components(net)
    if parts > 1:
        largest = len(max(nx.connected_components(net), key=len))
        raise InputError(
            f"graph: {states} states fall into {parts} parts, the largest of {largest}; "
            "no walk can cover it: join them, or walk the largest part alone"
        )
    return _csr(net)


def random_graph(spec: str, rng: np.random.Generator) -> Graph:
    """Draw the graph of a spec and keep its largest connected part.

    ``er:1000:9`` joins each pair with the probability that gives mean degree 9 (Erdos-Renyi);
    ``ws:1000:6:0.1`` is a ring with 3 neighbours on either side, each edge moved to a random end
    with probability 0.1 (Watts-Strogatz); at an odd degree every second state gets one edge more.
    Sparse random graphs are hardly ever connected (at mean degree 3 one state in twenty has no edge
    at all), so the largest part is what walks are run on: V is then less than asked.

    Raises:
        InputError: the spec is none of these.

    """
    kind, states, degree, rewired = _parse(spec)
    seed = int(rng.integers(2**31))
    if kind == "er":
        net = nx.fast_gnp_random_graph(states, degree / (states - 1), seed=seed)
    else:
        net = _small_world(states, int(degree), rewired, rng)
    largest = max(nx.connected_components(net), key=len)
    if len(largest) < 2:
        raise InputError(f"graph {spec!r}: fell apart into single states; raise the degree")
    return _csr(nx.convert_node_labels_to_integers(net.subgraph(sorted(largest))))


def check_spec(spec: str) -> None:
    """Raise InputError where ``spec`` is none that ``random_graph`` can draw."""
    _parse(spec)


def threshold_graph(states: NDArray[np.complex128], threshold: float) -> Graph:
    """Join states (S, n) whose Euclidean distance is under ``threshold`` ([KP] 4.2.1).

    Raises:
        InputError: not connected; says which threshold would be enough.

    """
    flat = np.concatenate([states.real, states.imag], axis=1)
    distance = squareform(pdist(flat))
    first, second = np.nonzero(np.triu(distance < threshold, 1))
    try:
        return graph_from_edges(len(states), zip(first.tolist(), second.tolist(), strict=True))
    except InputError as error:
        if len(states) < 2:
            raise
        # + 1: the spanning tree takes a distance of 0 for no edge
        needed = float(minimum_spanning_tree(distance + 1.0).data.max()) - 1.0
        raise InputError(
            f"{error.faults[0]} (threshold {threshold:.4g}; above {needed:.4g} all are joined)"
        ) from None


def _parse(spec: str) -> tuple[str, int, float, float]:
    parts = spec.split(":")
    try:
        if parts[0] == "er" and len(parts) == 3:
            kind, states, degree, rewired = "er", int(parts[1]), float(parts[2]), 0.0
        elif parts[0] == "ws" and len(parts) == 4:
            kind, states, degree, rewired = "ws", int(parts[1]), int(parts[2]), float(parts[3])
        else:
            raise ValueError(spec)
    except ValueError:
        raise InputError(f"graph {spec!r}: {_SPEC}") from None
    least = 2.0 if kind == "ws" else 0.0
    if not (4 <= states <= 1_000_000 and least <= degree < states / 2 and 0.0 <= rewired <= 1.0):
        raise InputError(
            f"graph {spec!r}: needs 4 to 1000000 states, a degree "
            f"{'of 2 or more' if kind == 'ws' else 'of 0 or more'} and under half the states, and "
            "a rewired share from 0 to 1"
        )
    return kind, states, degree, rewired


def _small_world(
    states: int, degree: int, rewired: float, rng: np.random.Generator
) -> "nx.Graph[int]":
    near = [(q, (q + k) % states) for k in range(1, degree // 2 + 1) for q in range(states)]
    if degree % 2:
        near += [(q, (q + degree // 2 + 1) % states) for q in range(0, states, 2)]
    net: nx.Graph[int] = nx.Graph(near)
    for a, b in near:
        if rng.random() < rewired:
            c = int(rng.integers(states))
            if c != a and not net.has_edge(a, c):
                net.remove_edge(a, b)
                net.add_edge(a, c)
    return net


def _csr(net: "nx.Graph[int]") -> Graph:
    indptr = np.concatenate([[0], np.cumsum([net.degree(q) for q in range(len(net))])])
    indices = [n for q in range(len(net)) for n in sorted(net.neighbors(q))]
    return Graph(indptr.astype(np.int64), np.array(indices, dtype=np.int64))
