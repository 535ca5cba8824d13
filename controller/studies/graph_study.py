"""How fast a walk covers a graph, and how soon it returns: rule x graph x repeats (Fig. 9)."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import networkx as nx
import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.shape.graphs import (
    Graph,
    graph_from_edges,
    largest_part,
    random_edges,
    small_world_edges,
    threshold_graph,
)
from snakewalk.controller.shape.states import to_states
from snakewalk.controller.shape.walks import SHORT_RETURN, Walk, check_rule, walk
from snakewalk.controller.track.readers.load import load_track

_GRID = np.linspace(0.0, 8.0, 161)


@dataclass(frozen=True, slots=True)
class StudyResult:
    """One rule on ``repeats`` graphs of one kind; a seed gives every rule the same graphs."""

    graph: str
    rule: str
    repeats: int
    seed: int
    states: Floats
    """(R,) number of states |V| of each graph: its largest connected part."""
    mean_degree: float
    """Measured, mean over the graphs."""
    cover: Floats
    """(R,) steps until all states were visited, over |V|; NaN after V^2 steps."""
    short_returns: Floats
    """(R,) share of returns after less than 0.05 |V| steps, until cover."""
    short_steps: Floats
    """(R,) share of short returns in all steps."""
    short_per_state: Floats
    """(R,) such returns over |V|: comparable between walks of different length."""
    leaves: Floats
    """(R,) share of states with one neighbour; each except the walk's ends forces a short
    return."""
    grid: Floats
    """(G,) steps over |V|."""
    visited: Floats
    """(G,) share of visited states after each number of steps, mean over the repeats."""

    def to_dict(self) -> dict[str, object]:
        """Plain numbers, for JSON."""
        covered = self.cover[np.isfinite(self.cover)]
        return {
            "graph": self.graph,
            "rule": self.rule,
            "repeats": self.repeats,
            "seed": self.seed,
            "states": round(float(self.states.mean()), 1),
            "mean_degree": round(self.mean_degree, 3),
            "covered": len(covered),
            "cover_mean": round(float(covered.mean()), 4) if len(covered) else None,
            "cover_std": round(float(covered.std()), 4) if len(covered) else None,
            "cover_ci95": round(float(1.96 * covered.std(ddof=1) / np.sqrt(len(covered))), 4)
            if len(covered) > 1
            else None,
            "cover_worst": round(float(covered.max()), 4) if len(covered) else None,
            "seen_at_v": round(float(np.interp(1.0, self.grid, self.visited)), 4),
            "cover_each": [round(float(x), 4) if np.isfinite(x) else None for x in self.cover],
            "short_returns": round(float(self.short_returns.mean()), 4),
            "short_steps": round(float(self.short_steps.mean()), 4),
            "short_per_state": round(float(self.short_per_state.mean()), 4),
            "leaves": round(float(self.leaves.mean()), 4),
            "curve_steps": [round(float(x), 3) for x in self.grid],
            "curve_visited": [round(float(x), 4) for x in self.visited],
        }


def run_study(graph: str, rule: str, repeats: int, seed: int = 0) -> StudyResult:
    """Run ``rule`` on ``repeats`` fresh graphs of the spec ``graph`` (``graph_spec.graph_source``).

    Raises:
        InputError: unknown spec or rule, or no repeats.

    """
    draw = graph_source(graph)
    check_rule(rule)
    if repeats < 1:
        raise InputError(f"repeats: expected 1 or more, not {repeats}")
    states, degrees, leaves, cover, short, short_steps, per_state = np.empty((7, repeats))
    visited = np.zeros(len(_GRID))
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        drawn = draw(rng)
        done = walk(drawn, rule, int(rng.integers(drawn.states)), rng)
        states[repeat], degrees[repeat] = drawn.states, drawn.mean_degree
        leaves[repeat] = np.mean(drawn.degree == 1)
        cover[repeat] = done.steps / drawn.states if done.covered else np.nan
        gaps = return_gaps(done)
        short_count = np.count_nonzero(gaps < SHORT_RETURN * drawn.states)
        short[repeat], short_steps[repeat] = (
            short_count / max(1, len(gaps)),
            short_count / done.steps,
        )
        per_state[repeat] = short_count / drawn.states
        visited_shares = np.cumsum(_first_visits(done))
        visited += np.interp(
            _GRID * drawn.states, np.arange(len(visited_shares)), visited_shares / drawn.states
        )
    return StudyResult(
        graph=graph,
        rule=rule,
        repeats=repeats,
        seed=seed,
        states=states,
        mean_degree=float(degrees.mean()),
        cover=cover,
        short_returns=short,
        short_steps=short_steps,
        short_per_state=per_state,
        leaves=leaves,
        grid=_GRID,
        visited=visited / repeats,
    )


def return_gaps(done: Walk) -> Ints:
    """Steps between consecutive visits of the same state, (returns,)."""
    order = np.argsort(done.path, kind="stable")
    is_reversal = done.path[order][1:] == done.path[order][:-1]
    return np.asarray(np.diff(order)[is_reversal])


def _first_visits(done: Walk) -> Bools:
    first = np.zeros(len(done.path), dtype=bool)
    first[np.unique(done.path, return_index=True)[1]] = True
    return first


Draw = Callable[[np.random.Generator], Graph]
_MOST_EDGES = 20_000_000
_READERS = {".graphml": "read_graphml", ".gml": "read_gml", ".edgelist": "read_edgelist"}
_FORMS = (
    "expected er:STATES:DEGREE, ws:STATES:DEGREE:REWIRED, kp:TRACK[:THRESHOLD] or a graph file "
    "(.graphml, .gml, .edgelist), as er:1000:9, ws:1000:6:0.1, kp:worm-like or mine.graphml"
)


def graph_source(spec: str) -> Draw:
    """Return a function that draws the graphs of a spec.

    - ``er:1000:9``: random (Erdos-Renyi), mean degree 9;
    - ``ws:1000:6:0.1``: small world (Watts-Strogatz), 3 neighbours on either side, a tenth rewired;
    - ``kp:worm-like:40``: the states of a recording, joined at a distance up to the threshold ([KP]
      4.2.1); without a threshold, the smallest that joins all. Always the same graph;
    - ``mine.graphml``: a graph of your own (GraphML, GML or an edge list), taken as undirected.

    Sparse random graphs are hardly ever connected (at mean degree 3 one state in twenty has no edge
    at all). So walks run on the largest part, and V is smaller than requested.

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
        return _draw_from_recording(track, number[0] if number else None)
    raise InputError(f"graph {spec!r}: {_FORMS}")


def _file(path: Path) -> Draw:
    try:
        source_graph = getattr(nx, _READERS[path.suffix])(path)
    except FileNotFoundError:
        raise InputError(f"graph {path}: no such file") from None
    except (nx.NetworkXError, ValueError, TypeError, ParseError, UnicodeDecodeError) as error:
        raise InputError(f"graph {path}: is no {path.suffix[1:]} file: {error}") from None
    plain_graph: nx.Graph[Any] = nx.Graph(source_graph)
    number = {node: k for k, node in enumerate(plain_graph)}
    edges = np.array([[number[a], number[b]] for a, b in plain_graph.edges], dtype=np.int64)
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


def _draw_from_recording(track: str, threshold: float | None) -> Draw:
    graph = threshold_graph(to_states(load_track(track).angles_rad), threshold)
    return lambda _: graph


def _check(spec: str, states: float, degree: float, least: float) -> None:
    if states % 1 or not 4 <= states <= 1_000_000:  # infinite and NaN, too
        raise InputError(f"graph {spec!r}: expected 4 to 1000000 states, a whole number")
    if not least <= degree < states / 2:
        raise InputError(f"graph {spec!r}: the degree must be {least:g} to under half the states")
    if states * degree > 2 * _MOST_EDGES:
        raise InputError(f"graph {spec!r}: more than {_MOST_EDGES} edges; lower the degree")
