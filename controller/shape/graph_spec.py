"""Graphs by name: ``er:1000:9``, ``ws:1000:6:0.1``, ``kp:worm-like``."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np

from config.errors import InputError
from controller.capture.load import load_track
from controller.shape.graphs import (
    Graph,
    graph_from_edges,
    largest_part,
    random_edges,
    small_world_edges,
    threshold_graph,
)
from controller.shape.states import to_states

Draw = Callable[[np.random.Generator], Graph]
_MOST_EDGES = 20_000_000
_READERS = {".graphml": "read_graphml", ".gml": "read_gml", ".edgelist": "read_edgelist"}
_FORMS = (
    "expected er:STATES:DEGREE, ws:STATES:DEGREE:REWIRED, kp:TRACK[:THRESHOLD] or a graph file "
    "(.graphml, .gml, .edgelist), as er:1000:9, ws:1000:6:0.1, kp:worm-like or mine.graphml"
)


def graph_source(spec: str) -> Draw:
    """What draws the graphs of a spec.

    - ``er:1000:9``: random (Erdos-Renyi), mean degree 9;
    - ``ws:1000:6:0.1``: small world (Watts-Strogatz), 3 neighbours on either side, a tenth rewired;
    - ``kp:worm-like:40``: the states of a recording, joined where they are no further apart
      ([KP] 4.2.1); without a threshold, the smallest that joins all. Always the same graph;
    - ``mine.graphml``: a graph of your own (GraphML, GML or an edge list), taken as undirected.

    Sparse random graphs are hardly ever connected (at mean degree 3 one state in twenty has no edge
    at all), so the largest part is what walks are run on: V is then less than asked.

    Raises:
        InputError: none of these; a recording that cannot be read, or falls apart.

    """
    if Path(spec).suffix in _READERS:
        return _file(Path(spec))
    kind, *rest = spec.split(":")
    track = rest.pop(0) if kind == "kp" and rest else ""
    try:
        number = [float(text) for text in rest]
    except ValueError:
        number = []
    if kind == "er" and len(number) == 2:
        return _random(spec, number[0], number[1])
    if kind == "ws" and len(number) == 3:
        return _small_world(spec, *number)
    if track and len(number) == len(rest) < 2:
        return _recorded(track, number[0] if number else None)
    raise InputError(f"graph {spec!r}: {_FORMS}")


def _file(path: Path) -> Draw:
    import networkx as nx  # noqa: PLC0415  half a second, for graph files only

    try:
        found = getattr(nx, _READERS[path.suffix])(path)
    except FileNotFoundError:
        raise InputError(f"graph {path}: no such file") from None
    except (nx.NetworkXError, ValueError, TypeError, ParseError, UnicodeDecodeError) as error:
        raise InputError(f"graph {path}: is no {path.suffix[1:]} file: {error}") from None
    own: nx.Graph[Any] = nx.Graph(found)
    number = {node: k for k, node in enumerate(own)}
    edges = np.array([[number[a], number[b]] for a, b in own.edges], dtype=np.int64)
    graph = graph_from_edges(len(number), edges.reshape(-1, 2))
    return lambda _: graph


def _random(spec: str, states: float, degree: float) -> Draw:
    _check(spec, states, degree, 0.1)
    return lambda rng: largest_part(int(states), random_edges(int(states), degree, rng))


def _small_world(spec: str, states: float, degree: float, rewired: float) -> Draw:
    _check(spec, states, degree, 2)
    if degree % 1:
        raise InputError(f"graph {spec!r}: the degree of a small world must be a whole number")
    if not 0.0 <= rewired <= 1.0:
        raise InputError(f"graph {spec!r}: the rewired share must be from 0 to 1")
    return lambda rng: largest_part(
        int(states), small_world_edges(int(states), int(degree), rewired, rng)
    )


def _recorded(track: str, threshold: float | None) -> Draw:
    graph = threshold_graph(to_states(load_track(track).angles_rad), threshold)
    return lambda _: graph


def _check(spec: str, states: float, degree: float, least: float) -> None:
    if states % 1 or not 4 <= states <= 1_000_000:  # infinite and NaN, too
        raise InputError(f"graph {spec!r}: expected 4 to 1000000 states, a whole number")
    if not least <= degree < states / 2:
        raise InputError(f"graph {spec!r}: the degree must be {least:g} to under half the states")
    if states * degree > 2 * _MOST_EDGES:
        raise InputError(f"graph {spec!r}: more than {_MOST_EDGES} edges; lower the degree")
