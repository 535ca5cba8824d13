"""Slopes under the body: closed forms; and paths that a body can climb."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.terrain.relief import Relief, interpolated
from snakewalk.controller.terrain.safe_graph import RISK_LIMIT, Footprint
from snakewalk.controller.terrain.summary import path_relief, path_warnings
from tests.controller.terrain.test_planner import field, looked_at

CONFIG = PlannerConfig()


def nearness(ground: HeightField, config: PlannerConfig, points_m: Floats) -> Floats:
    """Return that of points (n, 2) to ground that cannot be climbed."""
    return interpolated(ground, Footprint(ground, config).layers, *points_m.T)[:, 5]


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 90.0, 180.0, 250.0])
def test_a_plane_is_climbed_along_its_gradient_and_lies_across_it(turn_deg: float) -> None:
    footprint = Footprint(field(lambda x, y: 0.15 * x), CONFIG)
    turn = np.radians(turn_deg)
    at = np.array([[0.0, 0.0], [0.8, -1.1], [-1.9, 1.9]])
    direction = np.tile([np.cos(turn), np.sin(turn)], (3, 1))
    up, side = footprint.slopes(at, direction)
    np.testing.assert_allclose(up, 0.15 * np.cos(turn), atol=1e-9)
    np.testing.assert_allclose(side, 0.15 * abs(np.sin(turn)), atol=1e-9)


def test_the_two_sides_of_a_valley_do_not_cancel() -> None:
    footprint = Footprint(field(lambda x, y: 0.2 * abs(y)), CONFIG)
    bottom = np.zeros((1, 2))
    up, side = footprint.slopes(bottom, np.array([[1.0, 0.0]]))
    assert up == pytest.approx(0.0, abs=1e-9)
    assert side == pytest.approx(0.2, rel=0.15)  # level only at the very bottom
    up, side = footprint.slopes(bottom, np.array([[0.0, 1.0]]))
    assert up == pytest.approx(0.0, abs=1e-9)
    assert side == pytest.approx(0.0, abs=1e-9)


def test_nearness_falls_over_the_clearance() -> None:
    """A wall along x = 1: its footprint's slope is over the limit from 0.3 m before it on."""
    config = PlannerConfig(clearance_m=0.8)
    ground = field(lambda x, y: 0.5 * (x > 1.0))
    x = np.linspace(-1.5, 1.0, 51)
    near = nearness(ground, config, np.stack([x, 0.0 * x], axis=-1))
    wall = x[np.flatnonzero(near == 1.0)[0]]
    assert 0.65 < wall < 0.85
    np.testing.assert_allclose(near, np.clip(1.0 - (wall - x) / 0.8, 0.0, 1.0) ** 2, atol=0.12)
    level = field(lambda x, y: 0.1 * x)
    assert (nearness(level, config, np.stack([x, 0.0 * x], axis=-1)) == 0.0).all()


def test_an_edge_weighs_what_its_fields_say_at_its_points() -> None:
    """The formula of the graph, by the fields one by one."""
    config = PlannerConfig(clearance_m=0.8)
    ground = field(lambda x, y: 0.12 * np.sin(1.3 * x) * np.cos(1.7 * y))
    graph = TerrainPlanner(ground, config).graph
    assert graph is not None
    relief, footprint = Relief(ground, config), Footprint(ground, config)
    random = np.random.default_rng(0)
    a, turn = random.uniform(-1.9, 1.9, (200, 2)), random.uniform(-np.pi, np.pi, 200)
    ahead = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    b = a + 0.04 * ahead
    weight = []
    for sign in (1.0, -1.0):
        ends = []
        for at in (a, b):
            up, side = footprint.slopes(at, sign * ahead) / np.tan(config.climb_limit_rad)
            level = 1.0 + config.clearance_weight * nearness(ground, config, at)
            level += config.side_weight * side**4 + config.climb_weight * np.maximum(up, 0.0) ** 4
            uneven = relief.variance_m2(*at.T) / config.node_spacing_m
            ends.append(uneven + config.length_weight * level)
        weight.append(0.04 * np.mean(ends, axis=0))
    risk = np.maximum(relief.risk(*a.T), relief.risk(*b.T))
    there, back, safe = graph.edge_cost(a, b)
    np.testing.assert_allclose(there, weight[0], rtol=1e-9)
    np.testing.assert_allclose(back, weight[1], rtol=1e-9)
    np.testing.assert_array_equal(safe, risk <= RISK_LIMIT)
    assert 20 < safe.sum() < 180


def test_uphill_costs_more_than_downhill_and_a_contour_less() -> None:
    graph = TerrainPlanner(field(lambda x, y: 0.12 * x), CONFIG).graph
    assert graph is not None
    a, b, c = (np.array([at]) for at in ((-0.5, 0.0), (0.5, 0.0), (-0.5, 1.0)))
    up, down, safe = (float(part[0]) for part in graph.edge_cost(a, b))
    assert safe
    assert [float(part[0]) for part in graph.edge_cost(b, a)] == pytest.approx([down, up, 1.0])
    contour, back, _ = (float(part[0]) for part in graph.edge_cost(a, c))
    assert contour == pytest.approx(back)
    assert down < contour < up
    share = (0.12 / np.tan(CONFIG.climb_limit_rad)) ** 4
    assert up - down == pytest.approx(CONFIG.length_weight * CONFIG.climb_weight * share)
    assert contour - down == pytest.approx(CONFIG.length_weight * CONFIG.side_weight * share)


@pytest.mark.parametrize("slope_deg", [3.0, 7.0, 11.0, 15.0, 18.0])
def test_a_slope_is_climbed_straight_and_not_by_hairpins(slope_deg: float) -> None:
    """Whether it is under the climb limit or over it, where no other way leads up."""
    rise = np.tan(np.radians(slope_deg))
    config = PlannerConfig(variance_limit_m2=1e-2)
    path = TerrainPlanner(field(lambda x, y: rise * x), config).plan([(-1.5, 0.1), (1.5, 0.2)])
    np.testing.assert_allclose(looked_at(path), looked_at(SplinePath([(-1.5, 0.1), (1.5, 0.2)])))


def band(x, y):
    """A bank of 0.3 m along y at x = 0: 17 degrees, but 6 degrees in a pass at y = 1."""
    half = 0.5 + 1.0 * np.exp(-(((y - 1.0) / 0.5) ** 2))
    return 0.3 * np.clip((x + half) / (2.0 * half), 0.0, 1.0)


def test_a_bank_is_climbed_by_the_pass_and_descended_straight() -> None:
    planner = TerrainPlanner(field(band, half=3.0), PlannerConfig(variance_limit_m2=1e-2))
    ends = np.array([(-2.2, -0.6), (2.2, -0.6)])
    blind = PlannerConfig(
        variance_limit_m2=1e-2, climb_weight=0.0, side_weight=0.0, clearance_weight=0.0
    )
    straight = TerrainPlanner(field(band, half=3.0), blind).plan(ends)
    assert looked_at(straight)[:, 1].max() < 0.2
    assert looked_at(planner.plan(ends))[:, 1].max() > 0.8
    assert looked_at(planner.plan(ends[::-1]))[:, 1].max() < 0.2


def test_half_a_body_is_kept_from_a_hill_where_there_is_room() -> None:
    """Between two steep hills the path takes the middle; where there is room it goes farther."""

    def hills(x, y):
        return 0.5 * np.exp(-(x**2 + (y - 1.3) ** 2) / 0.1) + 0.5 * np.exp(
            -(x**2 + (y + 0.9) ** 2) / 0.1
        )

    ground = field(hills, half=3.0)
    path = TerrainPlanner(ground, CONFIG).plan([(-2.0, -0.3), (2.0, -0.3)])
    at = looked_at(path)
    assert at[np.argmin(abs(at[:, 0])), 1] == pytest.approx(0.2, abs=0.12)
    near = nearness(ground, CONFIG, at)
    plain = PlannerConfig(clearance_weight=0.0, side_weight=0.0, climb_weight=0.0)
    direct = TerrainPlanner(ground, plain).plan([(-2.0, -0.3), (2.0, -0.3)])
    before = nearness(ground, CONFIG, looked_at(direct))
    assert near.mean() < before.mean()
    assert near.max() < before.max()


def test_a_path_along_a_valley_is_level_and_what_the_body_stands_on_is_not() -> None:
    config = PlannerConfig(variance_limit_m2=1e-2)
    planner = TerrainPlanner(field(lambda x, y: 0.2 * abs(y)), config)
    points = [(-1.5, 0.0), (0.0, 0.0), (1.5, 0.0)]
    relief = path_relief(planner, planner.plan(points))
    assert relief.max_slope_rad == pytest.approx(0.0, abs=1e-6)
    assert relief.median_footprint_slope_rad == pytest.approx(np.arctan(0.2))
    assert relief.max_up_slope_rad == pytest.approx(0.0, abs=1e-9)
    assert relief.max_side_slope_rad == pytest.approx(np.arctan(0.2), rel=0.15)
    assert path_warnings(planner, relief, [points[1]]) == ()
    off = path_warnings(planner, relief, [(0.0, 1.0), (1.0, 0.0)])
    assert [line[:45] for line in off] == ["waypoint 1 (0.00, 1.00) is on a slope of 11.3"]
    steep = TerrainPlanner(field(lambda x, y: 0.3 * y), PlannerConfig(variance_limit_m2=1e-2))
    across = path_relief(steep, steep.plan([(-1.5, 0.0), (1.5, 0.0)]))
    assert path_warnings(steep, across, [])[-1].startswith("the path leads across 16.7 deg; the")
