"""Paths keep the body, and where they can its wave, away from poles, pegs and walls."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.world import (
    WALL_M,
    CorridorObstacle,
    Obstacle,
    PegsObstacle,
    PlannerConfig,
    PoleObstacle,
)
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.terrain.keep_off import KeepOff, level_ground
from snakewalk.controller.terrain.planner import TerrainPlanner
from tests.helpers.planned import whole_path

RADIUS_M, REACH_M = 0.03, 0.2
BOARD = PegsObstacle(spacing_m=0.3, rows=8, row_pegs=8, at_m=(0.0, 0.0))


def planner(obstacle: Obstacle, points_m: np.ndarray) -> TerrainPlanner:
    ground = level_ground(12.0, points_m)
    return TerrainPlanner(ground, PlannerConfig(), keep_off=KeepOff(obstacle, RADIUS_M, REACH_M))


def least_gap_m(obstacle: Obstacle, points_m: np.ndarray) -> tuple[float, float]:
    """Least distance of the path, and its length."""
    path = whole_path(planner(obstacle, points_m), points_m)
    return float(obstacle.gap_m(*path.piece_m(0.0, path.length_m).T).min()), path.length_m


@pytest.mark.parametrize("seed", range(6))
def test_a_path_clears_a_drawn_pole_between_its_ends(seed: int) -> None:
    chance = np.random.default_rng([seed, 64])
    pole = PoleObstacle(radius_m=chance.uniform(0.03, 0.4), at_m=tuple(chance.uniform(-1, 1, 2)))
    away = chance.uniform(-np.pi, np.pi)
    ends = np.array([pole.at_m]) + 2.0 * np.array([[np.cos(away), np.sin(away)]]) * [[1], [-1]]
    gap_m, length_m = least_gap_m(pole, ends)
    assert gap_m >= REACH_M
    assert length_m < 4.0 + np.pi * (pole.radius_m + 2.0 * REACH_M)


def test_a_path_leads_around_pegs_that_stand_closer_than_the_wave() -> None:
    gap_m, length_m = least_gap_m(BOARD, np.array([(-2.5, 0.0), (2.5, 0.0)]))
    assert gap_m >= REACH_M
    assert length_m > 5.3


def test_without_another_way_the_path_leads_where_the_body_has_room() -> None:
    narrow = CorridorObstacle(width_m=0.2, length_m=4.0)
    gap_m, length_m = least_gap_m(narrow, np.array([(-3.0, 0.0), (0.0, 0.0)]))
    assert RADIUS_M < gap_m <= 0.1
    assert length_m < 3.1
    with pytest.raises(InputError, match="nearer to it than the radius"):
        least_gap_m(CorridorObstacle(width_m=0.04), np.array([(-3.0, 0.0), (0.0, 0.0)]))
    with pytest.raises(InputError, match=r"waypoint 1 .* is in the world's obstacle") as error:
        least_gap_m(narrow, np.array([(-3.0, 0.0), (0.0, 0.12)]))
    assert "--set" not in str(error.value), "no limit of the planner permits it"


def test_distances_are_those_of_the_parts() -> None:
    chance = np.random.default_rng(3)
    points = chance.uniform(-3.0, 3.0, (500, 2))
    pegs_m = np.array(BOARD.places_m())
    nearest = np.hypot(*(points[:, None] - pegs_m).transpose(2, 0, 1)).min(axis=1)
    np.testing.assert_allclose(BOARD.gap_m(*points.T), nearest - BOARD.radius_m)
    walls = CorridorObstacle(width_m=1.0, length_m=2.0, at_m=(0.5, -0.3))
    x = np.linspace(-0.5, 1.5, 201)
    rims = [(x, np.full(201, -0.3 + side * (0.5 + t))) for side in (1, -1) for t in (0.0, WALL_M)]
    for side in (1, -1):
        y = -0.3 + side * np.linspace(0.5, 0.5 + WALL_M, 21)
        rims += [(np.full(21, edge), y) for edge in (-0.5, 1.5)]
    rim = np.concatenate([np.stack(part, axis=-1) for part in rims])
    brute = np.hypot(*(points[:, None] - rim).transpose(2, 0, 1)).min(axis=1)
    gap = walls.gap_m(*points.T)
    np.testing.assert_allclose(np.abs(gap), brute, atol=0.006)
    inside = (np.abs(points[:, 0] - 0.5) < 1.0) & (np.abs(np.abs(points[:, 1] + 0.3) - 0.52) < 0.02)
    assert ((gap < 0) == inside).all()


def test_a_walk_plans_around_the_obstacle_of_its_world() -> None:
    keys = {"world.obstacle.at_m": (2.0, 0.0)}
    walk = prepare_walk("flat-slalom", world="pole", keys=keys, waypoints_m=((4.0, 0.0),))
    assert walk.keep_off is not None
    assert walk.keep_off.distance_text(walk.path).endswith("m to the side clears it")
    narrow = prepare_walk("flat-slalom", world="corridor", waypoints_m=((5.0, 0.0),))
    assert narrow.keep_off is not None
    text = narrow.keep_off.distance_text(narrow.path)
    assert (
        text == "corridor, 0.10 m from the path: a wave that reaches 0.20 m to the side touches it"
    )
    assert prepare_walk("flat-slalom").keep_off is None
