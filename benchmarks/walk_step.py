"""A step of the snake walk at 1e3, 1e5 and 1e6 states, and of the frontier walk at 1e3 to 1e5.

On a graph a step looks at the neighbours only: its time must not grow with the states but for what
the processor's caches cost, which a random walk without memory on the same neighbour lists pays,
too. Both walk as many steps as there are states, their lists included. The frontier walk is taken
to its end, as its searches come late; it has no target. On the star of [PT] 2.6.2 every state is a
candidate, so a step is O(V); beside it the sum of two arrays of V integers.
"""

from itertools import pairwise
from random import Random

import numpy as np

from benchmarks.rows import Row, cpu_s
from snakewalk.controller.shape.graphs import Graph
from snakewalk.controller.shape.star import star_order
from snakewalk.controller.shape.walks import walk
from snakewalk.controller.studies.graph_study import graph_source

TITLE = "A step of the snake walk"

SIZES = (1_000, 100_000, 1_000_000)
OVER_RANDOM = 15.0
OVER_SUM = {1_000: 60.0, 100_000: 12.0, 1_000_000: 12.0}
"""At 1000 states a sum takes less than the call of any other function of numpy."""


def wander(graph: Graph, steps: int) -> int:
    """Walk at random and remember nothing; returns where it ended."""
    flat = graph.indices.tolist()
    near = [flat[a:b] for a, b in pairwise(graph.indptr.tolist())]
    draw = Random(0).random
    here = 0
    for _ in range(steps):
        around = near[here]
        here = around[int(draw() * len(around))]
    return here


def on_graph(states: int) -> Row:
    """Random graph, mean degree 9."""
    rng = np.random.default_rng(0)
    graph = graph_source(f"er:{states}:9")(rng)
    tries = max(1, 100_000 // states)
    ours_s = cpu_s(lambda: walk(graph, "snake", 0, rng, states), 1, tries)
    random_s = cpu_s(lambda: wander(graph, states), 1, tries)
    return Row(
        f"graph of {states} states, mean degree 9",
        ours_s / states * 1e6,
        "us",
        "a random walk",
        ours_s / random_s,
        OVER_RANDOM,
    )


def to_the_end(states: int) -> Row:
    """The frontier walk until a random graph of mean degree 9 is covered."""
    rng = np.random.default_rng(0)
    graph = graph_source(f"er:{states}:9")(rng)
    steps = walk(graph, "frontier", 0, rng).steps
    ours_s = cpu_s(lambda: walk(graph, "frontier", 0, rng), 1, max(1, 10_000 // states))
    return Row(
        f"frontier walk of {states} states, mean degree 9, to its end", ours_s / steps * 1e6, "us"
    )


def on_star(states: int, *, fresh: bool) -> Row:
    """All states candidates; a tenth unvisited, or all visited and failed, which takes longest."""
    rng = np.random.default_rng(0)
    visits = rng.integers(1, 50, states)
    if fresh:
        visits[rng.random(states) < 0.1] = 0
    failures = np.minimum(rng.integers(1, 50, states), visits)
    error_rad = rng.normal(size=states)
    times = max(1, 1_000_000 // states)
    ours_s = cpu_s(lambda: next(star_order(visits, failures, error_rad)), times)
    out = np.empty_like(visits)
    sum_s = cpu_s(lambda: np.add(visits, failures, out=out), times)
    return Row(
        f"star of {states} states, " + ("a tenth unvisited" if fresh else "all visited, F > 0"),
        ours_s * 1e6,
        "us",
        "a sum of V integers",
        ours_s / sum_s,
        OVER_SUM[states],
    )


def run() -> list[Row]:
    """Measure."""
    return [
        *(on_graph(states) for states in SIZES),
        *(to_the_end(states) for states in (1_000, 10_000, 100_000)),
        *(on_star(states, fresh=fresh) for states in SIZES for fresh in (True, False)),
    ]
