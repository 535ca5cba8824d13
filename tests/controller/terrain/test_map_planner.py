"""Paths on a map that is known in part: over what is known and safe, towards what is not."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.map_planner import MapPlanner
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.terrain.relief import Relief
from tests.helpers.planned import whole_path

CONFIG = PlannerConfig()
SIDE = np.linspace(-3.0, 3.0, 121)
X, Y = np.meshgrid(SIDE, SIDE)
START, GOAL = np.array([-2.0, 0.0]), np.array([2.0, 0.0])


def ground(known: np.ndarray, z: np.ndarray | None = None) -> HeightField:
    heights = np.zeros_like(X) if z is None else z
    return HeightField(heights.copy(), 0.05, -3.0, -3.0, known)


def planned(field: HeightField, points: np.ndarray) -> np.ndarray:
    planner = MapPlanner(CONFIG)
    planner.update(field)
    path = whole_path(planner, points)
    return path.piece_m(0.0, path.length_m)


def test_before_there_is_a_map_it_goes_straight() -> None:
    planner = MapPlanner(CONFIG)
    path = whole_path(planner, [START, GOAL])
    assert path.length_m == pytest.approx(4.0)
    assert not planner.safe(START)
    assert planner.clear(np.array([START, GOAL]))


def test_on_a_whole_map_it_is_the_planner() -> None:
    z = 0.4 * np.exp(-(X**2 + (Y - 0.2) ** 2) / (2 * 0.3**2))
    field = ground(np.ones(X.shape, bool), z)
    found = planned(field, np.array([START, GOAL]))
    path = whole_path(TerrainPlanner(field, CONFIG), [START, GOAL])
    np.testing.assert_allclose(found, path.piece_m(0.0, path.length_m))


def test_towards_an_unknown_waypoint_it_ends_on_the_last_known_safe_ground() -> None:
    field = ground(X < 0.5)
    found = planned(field, np.array([START, GOAL, [2.0, 2.0]]))
    assert found[-1] == pytest.approx([0.15, 0.0], abs=0.2)
    assert Relief(field, CONFIG).safe(*found.T).all()


def test_known_waypoints_on_the_way_are_passed() -> None:
    middle = np.array([-0.5, 0.8])
    found = planned(ground(X < 0.5), np.array([START, middle, GOAL]))
    assert np.hypot(*(found - middle).T).min() < 0.01


def test_it_keeps_out_of_a_dead_end_that_it_knows() -> None:
    """Straight ahead the known ground ends at a wall; around it nothing is known yet."""
    wall = (np.abs(X - 0.8) < 0.1) & (np.abs(Y) < 1.2)
    z = np.where(wall, 0.5, 0.0)
    known = (X < 1.0) & (Y > -1.3) & (Y < 2.2)
    found = planned(ground(known, z), np.array([START, GOAL]))
    assert abs(found[-1][1]) > 1.2  # beside the wall, not in front of it


def test_what_is_seen_to_be_unsafe_is_not_clear_and_what_is_unknown_is() -> None:
    z = np.where(X > 1.0, X - 1.0, 0.0)
    planner = MapPlanner(CONFIG)
    planner.update(ground(X < 2.0, z))
    assert planner.clear(np.array([[-1.0, 0.0], [0.0, 0.0]]))
    assert not planner.clear(np.array([[-1.0, 0.0], [1.6, 0.0]]))
    planner.update(ground(X < 0.0))
    assert planner.clear(np.array([[1.5, 0.0]]))
    assert not planner.safe(np.array([1.5, 0.0]))
    assert planner.safe(np.array([-1.5, 0.0]))


def test_without_any_safe_ground_it_says_so() -> None:
    planner = MapPlanner(CONFIG)
    planner.update(ground(np.zeros(X.shape, bool)))
    with pytest.raises(InputError, match="no safe ground"):
        whole_path(planner, np.array([START, GOAL]))
