"""Dubins curves: known lengths, both ends met, no shorter admissible curve, and joined paths."""

import itertools

import numpy as np
import pytest

from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.dubins import PathTurns, dubins_curves
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from tests.controller.terrain.test_planner import field, hill
from tests.helpers.planned import whole_path

PI = np.pi


def shortest_m(x: float, y: float, heading: float, radius: float = 1.0) -> float:
    """From the origin, heading along x."""
    curves = dubins_curves((0.0, 0.0), 0.0, [(x, y)], [heading], radius)
    return float(curves.length_m.min())


@pytest.mark.parametrize(
    ("x", "y", "heading", "length"),
    [
        (5.0, 0.0, 0.0, 5.0),
        (0.0, 0.0, 0.0, 0.0),
        (0.0, 2.0, PI, PI),  # half a turn to the left
        (0.0, -2.0, PI, PI),
        (1.0, 1.0, PI / 2, PI / 2),
        (-1.0, 1.0, -PI / 2, 3 * PI / 2),
        (4.0, 2.0, 0.0, PI / 3 + np.sqrt(12.0)),  # an S: the inner tangent of circles 4 apart
        (0.0, 0.0, PI, 7 * PI / 3),  # three arcs of pi/3, 5 pi/3, pi/3: turned on the spot
        (-4.0, 0.0, 0.0, 2 * PI + 4.0),  # a place straight behind
    ],
)
def test_known_lengths(x: float, y: float, heading: float, length: float) -> None:
    assert shortest_m(x, y, heading) == pytest.approx(length, abs=1e-8)
    assert shortest_m(0.3 * x, 0.3 * y, heading, 0.3) == pytest.approx(0.3 * length, abs=1e-8)
    assert shortest_m(x, -y, -heading) == pytest.approx(length, abs=1e-8)  # mirrored


def test_every_curve_ends_at_its_goal_and_bends_no_more_than_it_may() -> None:
    rng = np.random.default_rng(1)
    goals, headings = rng.uniform(-3, 3, (200, 2)), rng.uniform(-PI, PI, 200)
    curves = dubins_curves((0.4, -0.2), 0.7, goals, headings, 0.6)
    there = np.isfinite(curves.length_m)
    points = np.zeros((200, 8, 2001, 2))
    points[there] = curves.samples(np.flatnonzero(there), 2001)
    assert there[:, :2].any()
    assert there[:, 4:].any()
    assert not there.all()
    goal = np.broadcast_to(goals[:, None], (200, 8, 2))
    np.testing.assert_allclose(points[there][:, 0], np.tile([0.4, -0.2], (there.sum(), 1)))
    np.testing.assert_allclose(points[there][:, -1], goal[there], atol=1e-9)
    step = np.diff(points[there], axis=1)
    direction = step[..., 0] + 1j * step[..., 1]
    chord = np.abs(direction)
    turn = np.abs(np.angle(direction[:, 1:] * direction[:, :-1].conj()))
    long = chord.min(axis=1) > 1e-6
    assert (turn[long] / chord[long][:, 1:]).max() <= 1.0 / 0.6 + 1e-3
    last = np.angle(direction[:, -1] * np.exp(-1j * np.repeat(headings, there.sum(axis=1))))
    assert np.abs(last[long]).max() < 2.1 * chord[long].max() / 0.6
    k = int(np.argmin(curves.length_m[3]))
    one = curves.position(3, k, np.linspace(0.0, curves.length_m[3, k], 2001))
    np.testing.assert_allclose(one, points[3, k], atol=1e-12)


@pytest.mark.costs("searches all curves of three pieces")
def test_no_shorter_curve_among_all_of_three_pieces() -> None:
    """Brute force: every left, right, straight word over a grid of its first two pieces.

    The third piece is the one that comes nearest to the goal; a curve that ends near enough must
    not be shorter than the closed form by more than the grid allows.
    """
    rng = np.random.default_rng(2)
    first, second = np.meshgrid(np.linspace(0, 2 * PI, 241), np.linspace(0, 2 * PI, 241))
    for x, y, heading in zip(*rng.uniform(-2.5, 2.5, (2, 6)), rng.uniform(-PI, PI, 6), strict=True):
        best = shortest_m(x, y, heading)
        for a, b, c in itertools.product((1.0, 0.0, -1.0), repeat=3):
            if a == b or b == c:
                continue
            # the heading fixes the third arc; a straight third piece is scanned by its length
            turned = a * first + b * second
            third = np.mod(c * (heading - turned), 2 * PI) if c else np.abs(x + 1j * y)
            z, h, total = 0j, 0.0, 0.0
            for turn, length in ((a, first), (b, second), (c, third)):
                z = z + length * np.sinc(turn * length / (2 * PI)) * np.exp(
                    1j * (h + turn * length / 2)
                )
                h, total = h + turn * length, total + length
            off = np.abs(z - (x + 1j * y)) + np.abs(np.angle(np.exp(1j * (h - heading))))
            near = off < 0.03
            assert not near.any() or total[near].min() > best - 0.15


def level_cost(points_m: np.ndarray) -> np.ndarray:
    return np.ones(points_m.shape[:-1])


def heading_at(path: SplinePath, s: float) -> float:
    a, b = path.position([s, s + 0.005])
    return float(np.arctan2(*(b - a)[::-1]))


@pytest.mark.parametrize("heading", np.radians([0.0, 60.0, -120.0, 180.0]))
@pytest.mark.parametrize("ground", [None, field(lambda x, y: 0.0 * x)], ids=["floor", "level"])
def test_a_path_begins_with_the_body_and_passes_its_waypoints(ground, heading: float) -> None:
    points = np.array([(0.0, 0.0), (1.2, 0.3), (1.2, 1.2)])
    path = whole_path(TerrainPlanner(ground, PlannerConfig()), points, heading)
    np.testing.assert_allclose(path.position(0.0), points[0], atol=1e-12)
    assert abs(np.angle(np.exp(1j * (heading_at(path, 0.0) - heading)))) < 0.02
    at = path.position(np.arange(0.0, path.length_m, 0.005))
    nearest = [int(np.argmin(np.hypot(*(at - point).T))) for point in points]
    assert nearest == sorted(nearest)
    np.testing.assert_allclose(at[nearest], points, atol=0.012)
    np.testing.assert_allclose(path.position(path.length_m), points[-1], atol=1e-9)
    step = np.diff(path.position(np.arange(0.0, 1.0, 0.02)), axis=0)
    direction = step[:, 0] + 1j * step[:, 1]
    assert np.abs(np.angle(direction[1:] / direction[:-1])).max() <= 0.02 / 0.5 * 1.05
    assert (np.hypot(*np.diff(at, axis=0).T) < 0.0051).all()  # no jump where they join


def turned_onto(path: SplinePath, heading: float, radius_m: float, until_m: float) -> SplinePath:
    turns = PathTurns(path, heading, radius_m, until_m, level_cost, 1.0)
    return turns.onto(turns.cheapest())


def test_a_turn_joins_as_soon_as_it_pays() -> None:
    path = SplinePath([(0.0, 0.0), (8.0, 0.0)])
    ahead = turned_onto(path, 0.0, 0.5, 8.0)
    assert ahead.length_m == pytest.approx(8.0)
    aside = turned_onto(path, PI / 2, 0.5, 8.0)
    exact = dubins_curves((0.0, 0.0), PI / 2, [(8.0, 0.0)], [0.0], 0.5).length_m.min()
    assert aside.length_m == pytest.approx(exact, abs=2e-3)


def test_a_turn_stays_on_safe_ground_where_one_does() -> None:
    """The body stands beside a hill; the shortest turn back leads over the foot of it."""
    planner = TerrainPlanner(field(hill), PlannerConfig(edge_margin_m=0.1))
    points, heading = np.array([(-1.0, 0.5), (-1.5, -1.2)]), np.radians(30.0)
    level = turned_onto(whole_path(planner, points), heading, 0.5, 9.0)
    aware = whole_path(planner, points, heading)
    unsafe = [
        float((~planner.relief.safe(*path.position(np.arange(0.0, path.length_m, 0.01)).T)).mean())
        for path in (level, aware)
    ]
    assert unsafe[0] > 0.05
    assert unsafe[1] == 0.0
