"""The graph of [KP] 4.2.1 as printed: states are joined by distance."""

from collections.abc import Iterator

import numpy as np

from snakewalk.config.arrays import Complexes, Floats
from snakewalk.controller.shape.graphs import threshold_graph
from snakewalk.controller.shape.states import to_angles
from snakewalk.controller.shape.walks import walk


def graph_angles(
    states: Complexes, frames_between: int, points: int, rng: np.random.Generator
) -> Iterator[tuple[int, Floats]]:
    """Give the state that is left, and A_c (points,), frame by frame and without end.

    The graph has the smallest threshold that joins all states (S, n). Coefficients between two
    states are interpolated linearly.
    """
    graph = threshold_graph(states, None)
    state = 0
    while True:
        for after in walk(graph, "degree", state, rng).path.tolist()[1:]:
            share = np.arange(frames_between)[:, None] / frames_between
            between = states[state] + share * (states[after] - states[state])
            yield from ((state, angles) for angles in to_angles(between, points))
            state = after
