"""The graph of a recording's states: consecutive frames are neighbours, similar ones change course.

[KP] 4.2.1 joins states by distance. Its undirected edges let the film run backwards. Here an edge
leads from a frame to the next one (temporal), and to the successor of any frame that is closer to
it than its own neighbours are (similar). A walk by ``deg / 2^v`` follows these edges.

A random state (Eq. 8) becomes a film of its own: its pattern moves down the body, which changes
phases only, until it returns. It joins the graph if it comes close to a recorded state.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from snakewalk.config.arrays import Bools, Complexes, Floats, Ints
from snakewalk.controller.shape.states import padded_length, random_states, to_angles

_LEAST_PULSE = 0.5
"""Smallest pulse of a frame, as a share of the typical one (ours): rest is skipped."""
_REACH = 1.5
"""Distance up to which a random state is similar to a recorded one, over that of two recorded
states (ours). With 1 the walk hardly meets random states."""
_DRAWN = 2000
"""Random states that are tried (ours)."""


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
    random: int = 0
    """Number of random states, which come last."""

    def __post_init__(self) -> None:
        if not (np.diff(self.frame) == 1).any():
            raise ValueError("a film needs two consecutive frames")
        if not np.median(self.pulse_points) > 0.0:
            raise ValueError("the pattern of the film does not run to the tail")

    @property
    def typical_pulse_points(self) -> float:
        """Median of the pulse, points a frame."""
        return float(np.median(self.pulse_points))

    @property
    def is_followed(self) -> Bools:
        """(S,) whether the next frame was recorded."""
        return np.append(np.diff(self.frame) == 1, [False])

    @property
    def near(self) -> float:
        """Distance up to which states are similar: the median of recorded neighbours (ours)."""
        recorded = self.states[: len(self.states) - self.random]
        steps = np.linalg.norm(np.diff(recorded, axis=0), axis=1)
        return float(np.median(steps[self.is_followed[: len(steps)]]))


def with_random_states(
    film: FilmStates,
    points: int,
    count: int,
    is_possible: Callable[[Floats], bool],
    rng: np.random.Generator,
) -> FilmStates:
    """Append films of random states ([KP] Eq. 8) with ``count`` states or more.

    Such a film ends with its first state. ``is_possible`` judges its angles (frames, points). Fewer
    states are appended if too few of the drawn ones come close to the recording.
    """
    around = padded_length(points)
    frames = max(round(around / film.typical_pulse_points), 2)
    waves = np.arange(1, film.states.shape[1] + 1)
    turns = np.exp(-2j * np.pi * np.arange(frames + 1)[:, None] * waves / frames)
    courses: list[Complexes] = []
    for drawn in random_states(film.states, _DRAWN, rng):
        if len(courses) * (frames + 1) >= count:
            break
        course = drawn * turns
        distance = _distance(course, film.states[film.is_followed])
        if distance.min() <= _REACH * film.near and is_possible(to_angles(course, points)):
            courses.append(course)
    number = np.arange(len(courses))[:, None] * (frames + 2) + np.arange(frames + 1)
    return FilmStates(
        np.concatenate([film.states, *courses]),
        np.concatenate([film.frame, film.frame[-1] + 2 + number.ravel()]),
        np.concatenate([film.pulse_points, np.full(number.size, around / frames)]),
        number.size,
    )


def _distance(states: Complexes, others: Complexes) -> Floats:
    """(S, R) Euclidean distances of states (S, n) and (R, n)."""
    return cdist(states.view(float), others.view(float))


def film_successors(film: FilmStates, points: int) -> list[list[int]]:
    """List the states that can follow each of the S states, in ascending order.

    A recorded state without a recorded successor uses that of the most similar one at least half a
    body length of the film away.
    """
    frame_gap = np.abs(film.frame[:, None] - film.frame)
    distance = _distance(film.states, film.states)
    is_followed = film.is_followed
    recorded = len(film.frame) - film.random
    is_recorded = np.arange(len(film.frame)) < recorded
    can_follow = is_followed & is_recorded
    limit = film.near * np.where(is_recorded[:, None] == is_recorded, 1.0, _REACH)
    similar = (distance <= limit) & (frame_gap > 1) & is_followed
    far = can_follow & (frame_gap >= 0.5 * points / film.typical_pulse_points)
    successors = []
    for state in range(len(film.frame)):
        after = {int(other) + 1 for other in np.flatnonzero(similar[state])} - {state}
        if is_followed[state]:
            after.add(state + 1)
        if state < recorded <= min(after, default=recorded):
            others = np.flatnonzero(far[state] if far[state].any() else can_follow)
            after.add(int(others[np.argmin(distance[state, others])]) + 1)
        successors.append(sorted(after))
    return successors


def film_angles(
    film: FilmStates, points: int, rng: np.random.Generator
) -> Iterator[tuple[int, Floats]]:
    """Give the state that is left, and A_c (points,), frame by frame and without end.

    Coefficients are interpolated between states, so that the pattern of A_c moves by one point a
    frame, as Eq. 9 moves A_f. The walk begins at a random state that has a
    next one; without random states, at any.
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

    state = int(rng.choice(np.flatnonzero(film.is_followed)[-film.random :]))
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
