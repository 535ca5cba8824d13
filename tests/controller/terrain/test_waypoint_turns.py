"""Turns by waypoints: no bend that a body cannot follow, on safe ground, and the cheapest."""

import numpy as np
import pytest

from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.bends import sharpest_bend
from snakewalk.controller.terrain.dubins import PathTurns, dubins_curves
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.terrain.waypoint_turns import WaypointTurns
from tests.controller.terrain.test_dubins import heading_at, level_cost
from tests.controller.terrain.test_planner import field
from tests.helpers.planned import whole_path

BACK_AND_FORTH = np.array([(0.0, 0.0), (2.0, 0.0), (0.2, 0.05)])
BEND_M = PlannerConfig().bend_radius_m
RADIUS_M = 1.5 * BEND_M


def level_turns() -> WaypointTurns:
    return WaypointTurns(level_cost, 1.0, lambda points: True, BEND_M)


def assert_passes(path: SplinePath, points: np.ndarray) -> None:
    """In order, within the table's step; it begins and ends with them."""
    at_m = 0.0
    for point in points:
        at_m = path.first_pass(point, at_m)
        assert np.hypot(*(path.position(at_m) - point)) < 0.011
    np.testing.assert_allclose(path.position(path.length_m), points[-1], atol=1e-9)
    step = np.hypot(*np.diff(path.position(np.arange(0.0, path.length_m, 0.005)), axis=0).T)
    assert step.max() < 0.0051


def valley(half_width_m: float) -> TerrainPlanner:
    """A level strip along x between banks of 45 degrees."""
    config = PlannerConfig(slope_limit_rad=0.3, variance_limit_m2=0.05, edge_margin_m=0.1)
    return TerrainPlanner(
        field(lambda x, y: np.maximum(np.abs(y) - half_width_m, 0.0) + 0.0 * x), config
    )


@pytest.mark.parametrize("ground", [None, field(lambda x, y: 0.0 * x)], ids=["floor", "level"])
def test_a_path_that_turns_back_swings_out(ground) -> None:  # type: ignore[no-untyped-def]
    points = BACK_AND_FORTH - [1.0, 0.0]
    assert sharpest_bend(SplinePath(points))[0] < 0.1
    path = whole_path(TerrainPlanner(ground, PlannerConfig()), points)
    assert sharpest_bend(path)[0] > 0.95 * RADIUS_M
    assert_passes(path, points)


def test_a_waypoint_behind_the_body_gets_a_turn_that_the_body_can_follow() -> None:
    """A turn of 128 degrees at 0.19 m was left; a corner of 90 degrees at 0.2 m is followed."""
    points = np.array([(0.0, 0.0), (1.5, 0.0), (1.5, -0.8), (0.0, -0.8), (0.8, 0.2)])
    assert 0.45 * BEND_M < sharpest_bend(SplinePath(points))[0] < 0.25
    path = whole_path(TerrainPlanner(None, PlannerConfig()), points)
    assert sharpest_bend(path)[0] > BEND_M
    assert_passes(path, points)
    corners = np.array([(0.0, 0.0), (1.2, 0.0), (1.2, 1.2), (2.4, 1.2)])
    assert (
        sharpest_bend(whole_path(TerrainPlanner(None, PlannerConfig()), corners))[0] < 0.75 * BEND_M
    )


def test_round_bends_stay_as_they_are() -> None:
    points = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    path = SplinePath(points)
    same = level_turns()(path, points[1:], any_start=True)
    at = np.linspace(0.0, path.length_m, 500)
    np.testing.assert_allclose(same.position(at), path.position(at), atol=2e-4)


def test_the_direction_at_the_waypoint_is_the_cheapest_of_all() -> None:
    """On level ground the cost is the length; legs as long as these hold every turn back."""
    points = np.array([(0.0, 0.0), (4.0, 0.0), (0.5, 0.02)])
    path = level_turns()(SplinePath(points), points[1:], any_start=False)
    headings = np.arange(16) * 2.0 * np.pi / 16
    base = SplinePath(points)
    mark = base.first_pass(points[1])
    before = SplinePath.tabulated(base.position(np.linspace(mark, 0.0, 401)))
    after = SplinePath.tabulated(base.position(np.linspace(mark, base.length_m, 401)))
    each = [
        sum(
            PathTurns(leg, heading, RADIUS_M, leg.length_m, level_cost, 1.0, 40).cheapest().cost
            for leg, heading in ((before, angle + np.pi), (after, angle))
        )
        for angle in headings
    ]
    assert path.length_m == pytest.approx(min(each), abs=0.02)
    there_and_back = dubins_curves((4.0, 0.0), np.pi / 2, [(0.5, 0.02)], [np.pi], RADIUS_M)
    assert path.length_m < 4.0 + there_and_back.length_m.min() + 0.5


def test_a_turn_is_tighter_where_the_ground_leaves_no_room_and_none_where_it_has_none() -> None:
    points = BACK_AND_FORTH - [1.0, 0.0]
    roomy, narrow, slot = (whole_path(valley(half), points) for half in (1.6, 0.4, 0.2))
    for path in (roomy, narrow, slot):
        assert_passes(path, points)
    assert sharpest_bend(roomy)[0] > 0.95 * RADIUS_M
    assert 0.7 * BEND_M < sharpest_bend(narrow)[0] < 0.8 * BEND_M
    assert sharpest_bend(slot)[0] < 0.1
    planner = valley(0.4)
    along = whole_path(planner, points).position(np.arange(0.0, narrow.length_m, 0.01))
    assert planner.relief is not None
    assert planner.relief.safe(*along.T).all()
    assert not planner.relief.safe(*roomy.position(np.arange(0.0, roomy.length_m, 0.01)).T).all()


def test_the_start_may_turn_only_where_the_body_may_begin_in_any_direction() -> None:
    points = np.array([(0.0, 0.0), (0.15, 0.1), (0.0, 0.25), (-2.0, 0.3)])
    path = SplinePath(points)
    free = level_turns()(path, points[3:], any_start=True)
    assert sharpest_bend(path)[0] < 0.17
    assert sharpest_bend(free)[0] > 0.95 * RADIUS_M
    kept = level_turns()(path, points[3:], any_start=False)
    assert kept.length_m == pytest.approx(path.length_m, abs=1e-3)


def test_from_elsewhere_the_planned_path_is_kept_beyond_the_next_waypoint() -> None:
    points = np.vstack([BACK_AND_FORTH, [(-1.0, 1.0)]]) - [0.5, 0.0]
    planner = TerrainPlanner(None, PlannerConfig())
    planned = whole_path(planner, points)
    again = whole_path(planner, np.vstack([[(0.4, 0.9)], points[1:]]), 2.0)
    assert heading_at(again, 0.0) == pytest.approx(2.0, abs=0.02)
    assert_passes(again, points[1:])
    assert sharpest_bend(again)[0] > 0.45 * BEND_M
    left = planned.length_m - planned.first_pass(points[1])
    ends = [p.position(p.length_m - np.linspace(0.0, left - 0.02, 50)) for p in (planned, again)]
    np.testing.assert_allclose(*ends, atol=0.011)
