"""Graphs by name: ``er:1000:9``, ``ws:1000:6:0.1``, ``kp:worm-like``."""

from collections.abc import Callable

import numpy as np

from config.errors import InputError
from controller.capture.load import load_track
from controller.shape.graphs import (
    Graph,
    largest_part,
    random_edges,
    small_world_edges,
    threshold_graph,
)
from controller.shape.states import to_states

Draw = Callable[[np.random.Generator], Graph]
_MOST_EDGES = 20_000_000
_FORMS = (
    "expected er:STATES:DEGREE, ws:STATES:DEGREE:REWIRED or kp:TRACK[:THRESHOLD], "
    "as er:1000:9, ws:1000:6:0.1 or kp:worm-like"
)


def graph_source(spec: str) -> Draw:
    """What draws the graphs of a spec.

    - ``er:1000:9``: random (Erdos-Renyi), mean degree 9;
    - ``ws:1000:6:0.1``: small world (Watts-Strogatz), 3 neighbours on either side, a tenth rewired;
    - ``kp:worm-like:40``: the states of a recording, joined where they are no further apart
      ([KP] 4.2.1); without a threshold, the smallest that joins all. Always the same graph.

    Sparse random graphs are hardly ever connected (at mean degree 3 one state in twenty has no edge
    at all), so the largest part is what walks are run on: V is then less than asked.

    Raises:
        InputError: none of these; a recording that cannot be read, or falls apart.

    """
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
