"""[KP] 4.2.1: the walk on the fixed graph, and the angles that the head hands down (Eq. 9)."""

from itertools import islice, pairwise

import numpy as np
import pytest

from snakewalk.config.arrays import Complexes, Floats
from snakewalk.controller.animals.synthesis.graph_motion import (
    graph_motion,
    handed_down,
    leading,
)
from snakewalk.controller.shape.graphs import threshold_graph
from snakewalk.controller.shape.states import to_angles, to_states
from snakewalk.controller.terrain.path import SplinePath
from tests.oracles.graph_by_distance import graph_angles

N = 100
RNG = np.random.default_rng(7)


@pytest.fixture(scope="module")
def states() -> Complexes:
    s = np.arange(N) / N
    turns = 2 * np.pi * np.arange(24)[:, None] / 24
    return to_states(0.6 * np.sin(2 * np.pi * 1.3 * s - turns))


def test_where_m_is_one_at_the_head_alone_each_point_shows_what_the_head_showed() -> None:
    """Eq. 9 is then a pure delay: ``A_f(t, k) = A_c(t - k, 0)``."""
    m = np.zeros(N)
    m[0] = 1.0
    head = 0.5 * np.sin(0.13 * np.arange(300))
    body = np.zeros(N)
    for angle in head:
        body = handed_down(np.full(N, angle), body, m)
    np.testing.assert_array_equal(body, head[:-101:-1])


def test_where_m_is_one_everywhere_nothing_is_handed_down() -> None:
    """The angles of water snakes, A_c, as they are."""
    wanted, before = RNG.normal(size=(2, N))
    np.testing.assert_array_equal(handed_down(wanted, before, np.ones(N)), wanted)


def test_with_less_than_one_at_the_head_the_printed_rule_has_nothing_to_take_from() -> None:
    """ "Close to 1" leaves the share 1 - m of an angle ahead of the head, which does not exist.

    Taken as 0, as an array that ends there has it, the head bends less than every state asks.
    """
    m = leading(N)
    m[0] = 0.9
    with pytest.raises(ValueError, match=r"m: is 0\.9 at the head"):
        handed_down(np.ones(N), np.ones(N), m)
    printed = m * 1.0 + (1.0 - m) * np.concatenate([[0.0], np.ones(N - 1)])
    assert printed[0] == pytest.approx(0.9)  # all of the body is at 1, the head falls behind
    np.testing.assert_array_equal(handed_down(np.ones(N), np.ones(N), leading(N)), np.ones(N))


def test_angles_between_states_are_those_of_linear_coefficients(states: Complexes) -> None:
    frames = list(islice(graph_angles(states, 8, N, RNG), 1200))
    graph = threshold_graph(states, None)
    taken = [state for state, _ in frames[::8]]
    for k, (one, other) in enumerate(pairwise(taken)):
        near = graph.indices[graph.indptr[one] : graph.indptr[one + 1]]
        assert other in near  # along edges only
        middle = to_angles(0.5 * (states[one] + states[other]), N)
        np.testing.assert_allclose(frames[8 * k + 4][1], middle, atol=1e-12)
    assert len(set(taken)) == 24  # 2^-v sends it on, through all states


def lay(states: Complexes, path: SplinePath, frames: int) -> tuple[Floats, Floats]:
    shapes = graph_angles(states, 10, N, np.random.default_rng(0))
    made = graph_motion(
        shapes, path, frames, 0.01, 0.04, lambda *_: False, on_state=lambda *_: None
    )
    return made.angles_rad, made.points_m


def test_the_mass_centre_stays_on_the_path_and_the_body_heads_along_it(
    states: Complexes,
) -> None:
    path = SplinePath(np.array([[0.0, 0.0], [2.0, 0.5], [4.0, 0.0]]))
    angles, points = lay(states, path, 260)
    centre = points.mean(axis=1)
    fine = np.linspace(0.0, path.length_m, 8000)
    gap = np.linalg.norm(centre[:, None] - path.position(fine), axis=2)
    assert gap.min(axis=1).max() < 1e-3
    s_m = fine[gap.argmin(axis=1)]
    assert (np.diff(s_m) > 0.0).all()
    heading = np.array([path.heading_rad(s) for s in s_m])
    np.testing.assert_allclose(angles.mean(axis=1), heading, atol=5e-3)
    step = np.linalg.norm(np.diff(points, axis=1), axis=2)
    np.testing.assert_allclose(step, 0.01, rtol=1e-12)


def test_behind_the_leading_half_the_pattern_runs_down_a_point_a_frame(states: Complexes) -> None:
    """[KP] Fig. 12(b): the bends of the tail are those that the middle had before."""
    angles, _ = lay(states, SplinePath(np.array([[0.0, 0.0], [50.0, 0.0]])), 300)
    bends = np.diff(angles, axis=1)
    np.testing.assert_allclose(bends[101:, 51:], bends[100:-1, 50:-1], atol=1e-12)


def test_no_state_is_left_in_a_frame_that_is_not_made(states: Complexes) -> None:
    """At ten frames from state to state the 31st frame would begin the fourth."""
    path, told = SplinePath(np.array([[0.0, 0.0], [50.0, 0.0]])), []
    shapes = graph_angles(states, 10, N, np.random.default_rng(0))
    graph_motion(shapes, path, 30, 0.01, 0.04, lambda *_: False, lambda t, _: told.append(t))
    assert told == [0, 10, 20]
