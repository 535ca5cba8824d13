"""A way is found wherever safe ground joins two points, and the advice opens one elsewhere."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import label

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.exact_route import exact_route
from snakewalk.controller.terrain.in_steps import at_once
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.terrain.relief import Relief
from snakewalk.controller.terrain.rounded import rounded
from snakewalk.controller.terrain.route_advice import route_advice
from snakewalk.controller.terrain.safe_graph import SafeGraph

CONFIG = PlannerConfig()


def bumps(seed: int) -> HeightField:
    """6 m by 6 m with 30 smooth bumps."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-3.0, 3.0, 121)
    xx, yy = np.meshgrid(x, x)
    z = np.zeros_like(xx)
    for _ in range(30):
        (cx, cy), width, height = rng.uniform(-3, 3, 2), rng.uniform(0.2, 0.5), rng.uniform(-1, 1)
        z += 0.15 * height * np.exp(-((xx - cx) ** 2 + (yy - cy) ** 2) / (2 * width**2))
    return HeightField(z, 0.05, -3.0, -3.0)


def are_joined(relief: Relief, points: np.ndarray, step_m: float = 0.01) -> bool:
    """Brute force: whether safe points of a fine grid join all points."""
    ground = relief.ground
    w, h = ground.size_m
    x = ground.x0_m + np.arange(round(w / step_m) + 1) * step_m
    y = ground.y0_m + np.arange(round(h / step_m) + 1) * step_m
    parts, _ = label(relief.safe(*np.meshgrid(x, y)))
    at = np.round((points - (ground.x0_m, ground.y0_m)) / step_m).astype(int)
    found = parts[at[:, 1], at[:, 0]]
    return bool(found[0] > 0 and (found == found[0]).all())


@pytest.mark.parametrize(
    ("seed", "points"),
    [
        (9, [(2.07, 1.85), (-1.03, -0.85), (0.7, 1.41)]),  # along the margin
        (12, [(0.31, -2.19), (-1.93, -1.27), (-2.39, 0.88)]),
        (12, [(-1.33, -1.68), (-0.44, -1.14), (-1.07, 1.41)]),  # between the graph's nodes
        (21, [(0.3, 1.38), (-1.06, -1.29), (-1.53, 0.46)]),  # too narrow for a cubic
    ],
)
def test_a_route_is_found_where_safe_ground_joins_its_points(seed, points) -> None:
    planner, at = TerrainPlanner(bumps(seed), CONFIG), np.array(points)
    assert are_joined(planner.relief, at)
    path = planner.plan(at)
    assert planner.relief.safe(*path.position(np.arange(0.0, path.length_m, 0.02)).T).all()
    assert (
        max(np.hypot(*(path.position(s) - p)) for s, p in zip(path.passes(at), at, strict=True))
        < 0.01
    )


def test_where_no_route_exists_the_advice_opens_one() -> None:
    planner, at = TerrainPlanner(bumps(10), CONFIG), np.array([(0.08, -1.06), (1.97, 1.76)])
    assert not are_joined(planner.relief, at)
    with pytest.raises(InputError, match=r"cannot be reached (.|\n)* --set .*_limit_m2=0\.00043$"):
        planner.plan(at)
    wider = CONFIG.model_copy(update={"variance_limit_m2": 0.00043})
    TerrainPlanner(bumps(10), wider).plan(at)


def test_advice_names_the_margin_the_map_or_the_waypoint() -> None:
    x, y = np.meshgrid(*2 * [np.linspace(-2.0, 2.0, 81)])
    ends = np.array([(-1.5, 0.0), (1.5, 0.0)])

    def advice(z_m: np.ndarray, known: np.ndarray | None = None) -> str:
        ground = HeightField(z_m, 0.05, -2.0, -2.0)
        return route_advice(Relief(replace(ground, known=known), CONFIG), ends)

    assert "edge_margin_m=0.15" in advice(np.where((abs(x) < 0.2) & (y < 1.51), 3.0, 0.0))
    assert "move a waypoint" in advice(np.where(abs(x) < 0.2, 3.0, 0.0))
    assert "map does not know" in advice(0.0 * x, known=abs(x) > 0.2)
    bank_m = np.tan(np.radians(25.0)) * np.clip(x, 0.0, 1.2)
    words = advice(bank_m)
    assert re.fullmatch(r"--set .*slope_limit_rad=0\.44 --set .*variance_limit_m2=0\.005", words)


def random_risk(seed: int) -> tuple[Relief, SafeGraph, np.ndarray]:
    """Relief whose risk is random from sample to sample, its graph, and two safe points."""
    rng = np.random.default_rng(seed)
    ground = HeightField(np.zeros((10, 12)), 0.1, 0.0, 0.0)
    config = CONFIG.model_copy(update={"edge_margin_m": 0.13})
    relief = Relief(ground, config)
    relief._risk = rng.uniform(0.0, 1.8, ground.z_m.shape)
    points = np.round(rng.uniform(0.14, 0.75, (400, 2)), 3)
    points = points[relief.safe(*points.T)]
    return relief, SafeGraph(relief), points[[0, -1]]


def test_exact_routes_agree_with_brute_force() -> None:
    joined = refused = 0
    for seed in range(60):
        relief, graph, points = random_risk(seed)
        route = at_once(exact_route(relief, graph, *points))
        if route is None:
            assert not are_joined(relief, points, step_m=0.002)
            refused += 1
            continue
        joined += 1
        np.testing.assert_array_equal(route[[0, -1]], points)
        for before, after in itertools.pairwise(route):
            at = before + np.linspace(0.0, 1.0, 30)[:, None] * (after - before)
            assert relief.risk(*at.T).max() <= 1.0 + 1e-6
    assert joined > 20
    assert refused > 8


def test_a_rounded_polygon_stays_on_its_side_of_a_line_and_passes_fixed_corners() -> None:
    corners = np.array([(0.0, 1.0), (1.0, 0.0), (3.0, 0.0), (4.0, 1.0), (4.0, 3.0)])
    free = np.array([False, True, True, False, False])
    path = at_once(rounded(corners, free, lambda at: at[:, 1] >= 0.0))
    at = path.piece_m(0.0, path.length_m)
    assert at[:, 1].min() >= 0.0
    assert np.hypot(*(at - corners[3]).T).min() < 1e-2
    assert np.hypot(*(at - corners[1]).T).min() > 0.05
    sharp = at_once(rounded(corners, free, lambda at: np.zeros(len(at), bool)))
    assert np.hypot(*(sharp.piece_m(0.0, sharp.length_m) - corners[1]).T).min() < 1e-2
