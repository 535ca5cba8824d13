"""The graph of a recording's states: consecutive frames are neighbours, similar ones change course.

[KP] 4.2.1 joins states by distance. Its undirected edges let the film run backwards. Here an edge
leads from a frame to the next one (temporal), and to the successor of any frame that is closer to
it than its own neighbours are (similar). A walk by ``deg / 2^v`` follows these edges.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Complexes, Floats, Ints
from snakewalk.controller.shape.states import to_angles

_LEAST_PULSE = 0.5
"""Smallest pulse of a frame, as a share of the typical one (ours): rest is skipped."""


@dataclass(frozen=True, slots=True)
class FilmStates:
    """States of one recording in the order of its frames.

    Raises:
        ValueError: no two frames are consecutive, or the pattern does not run to the tail.

    """

    states: Complexes
    """(S, n) states of the recording."""
    frame: Ints
    """(S,) number of the frame, increasing."""
    pulse_points: Floats
    """(S,) points that the bends move down the body until the next frame."""

    def __post_init__(self) -> None:
        if not (np.diff(self.frame) == 1).any():
            raise ValueError("a film needs two consecutive frames")
        if not np.median(self.pulse_points) > 0.0:
            raise ValueError("the pattern of the film does not run to the tail")

    @property
    def typical_pulse_points(self) -> float:
        """Median of the pulse, points a frame."""
        return float(np.median(self.pulse_points))


def film_successors(film: FilmStates, points: int) -> list[list[int]]:
    """List the states that can follow each of the S states, in ascending order.

    Two states are similar if they are closer than the median of consecutive frames (ours). A state
    without a successor uses that of the most similar one at least half a body length of the film
    away.
    """
    frame_gap = np.abs(film.frame[:, None] - film.frame)
    parts = np.concatenate([film.states.real, film.states.imag], axis=1)
    squares = (parts**2).sum(axis=1)
    distance = np.sqrt(np.maximum(squares[:, None] + squares - 2.0 * parts @ parts.T, 0.0))
    is_followed = np.append(np.diff(film.frame) == 1, [False])
    limit = float(np.median(np.diagonal(distance, 1)[is_followed[:-1]]))
    similar = (distance <= limit) & (frame_gap > 1) & is_followed
    far = is_followed & (frame_gap >= 0.5 * points / film.typical_pulse_points)
    successors = []
    for state in range(len(film.frame)):
        after = {int(other) + 1 for other in np.flatnonzero(similar[state])} - {state}
        if is_followed[state]:
            after.add(state + 1)
        if not after:
            others = np.flatnonzero(far[state] if far[state].any() else is_followed)
            after.add(int(others[np.argmin(distance[state, others])]) + 1)
        successors.append(sorted(after))
    return successors


def film_angles(
    film: FilmStates, points: int, rng: np.random.Generator
) -> Iterator[tuple[int, Floats]]:
    """Give the state that is left, and A_c (points,), frame by frame and without end.

    Coefficients are interpolated between states, so that the pattern of A_c moves by one point a
    frame, as Eq. 9 moves A_f. The walk begins at a random frame that has a next one.
    """
    after = film_successors(film, points)
    degree = np.array([len(states) for states in after])
    np.add.at(degree, np.concatenate(after), 1)
    pulse = np.maximum(film.pulse_points, _LEAST_PULSE * film.typical_pulse_points)
    visits = np.zeros(len(after), dtype=np.int64)

    def follow(state: int) -> int:
        visits[state] += 1
        fewest = min(visits[q] for q in after[state])
        return max(after[state], key=lambda q: float(degree[q]) * 0.5 ** float(visits[q] - fewest))

    state = int(rng.choice(np.flatnonzero(np.diff(film.frame) == 1)))
    coming = follow(state)
    share = 0.0
    while True:
        while share >= 1.0:
            state = coming
            share = share - 1.0
            coming = follow(state)
        between = film.states[state] + share * (film.states[coming] - film.states[state])
        yield state, to_angles(between, points)
        share += 1.0 / float(pulse[state])
