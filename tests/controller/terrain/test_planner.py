"""The planner: plain on flat ground, around hills, held to its limits, clear when it cannot."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_run, load_world, shipped
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.bends import sharpest_bend, widen_in_steps
from snakewalk.controller.terrain.in_steps import at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner, straighten_in_steps
from snakewalk.controller.terrain.summary import path_relief, slopes_rad
from tests.helpers.planned import whole_path

CONFIG = PlannerConfig()
POINTS = np.array([(-1.5, -0.3), (0.2, 0.4), (1.4, -0.2)])


def field(of, half=2.0, spacing=0.05) -> HeightField:
    x = np.linspace(-half, half, round(2 * half / spacing) + 1)
    return HeightField(
        np.asarray(of(*np.meshgrid(x, x)), float) + np.zeros((len(x),) * 2), spacing, -half, -half
    )


def hill(x, y):
    return 0.4 * np.exp(-(x**2 + (y - 0.2) ** 2) / (2 * 0.3**2))


def ridge(x, y):
    """Across the whole world."""
    return 0.4 * np.exp(-(x**2) / (2 * 0.2**2)) + 0.0 * y


def looked_at(path: SplinePath) -> np.ndarray:
    return path.position(np.arange(0.0, path.length_m, 0.01))


@pytest.mark.parametrize("ground", [None, field(lambda x, y: 0.0 * x)], ids=["floor", "level"])
def test_on_level_ground_it_is_the_plain_spline(ground: HeightField | None) -> None:
    planner = TerrainPlanner(ground, CONFIG)
    for path in (whole_path(planner, POINTS), planner.plan(POINTS)):
        np.testing.assert_allclose(looked_at(path), looked_at(SplinePath(POINTS)), atol=1e-12)
    relief = path_relief(planner, whole_path(planner, POINTS))
    assert relief.max_slope_rad == pytest.approx(0.0, abs=1e-6)
    assert relief.safe_node_share == 1.0


def test_on_level_ground_variance_ties_and_length_decides() -> None:
    graph = TerrainPlanner(field(lambda x, y: 0.0 * x), CONFIG).graph
    assert graph is not None
    a, b = graph.nearest(np.array([-1.5, -1.5])), graph.nearest(np.array([1.5, 0.0]))
    way = graph.cheapest_path(a, b)
    length = np.hypot(*np.diff(way, axis=0).T).sum()
    assert length <= 1.03 * np.hypot(*(way[-1] - way[0]))  # the grid's own error; 16 neighbours
    assert len(at_once(straighten_in_steps(way, graph))) == 2


def test_variance_along_an_edge_ties_a_contour_with_every_detour_on_it() -> None:
    """As printed, both weigh 0 on a slope; with a length term the detour weighs more."""
    ground = field(lambda x, y: 0.2 * y + 0.0 * x)
    graph = TerrainPlanner(ground, CONFIG).graph
    assert graph is not None
    x = np.linspace(-1.0, 1.0, 81)
    there_and_back = np.concatenate([x, x[::-1], x])
    printed, weight = [], []
    for along in (x, there_and_back):
        points = np.stack([along, np.zeros_like(along)], axis=1)
        printed.append(ground.elevation_m(*points.T).var())
        weight.append(graph.cost_per_m(points).mean() * np.hypot(*np.diff(points, axis=0).T).sum())
    assert max(printed) < 1e-20
    assert weight[1] == pytest.approx(3.0 * weight[0], rel=0.01)
    assert weight[0] > 0.0


def test_a_hill_is_gone_around_by_the_shorter_side() -> None:
    planner = TerrainPlanner(field(hill), CONFIG)
    ends = np.array([(-1.5, 0.0), (1.5, 0.0)])
    path = planner.plan(ends)
    assert not planner.relief.safe(*SplinePath(ends).position(1.5))
    at = looked_at(path)
    assert planner.relief.safe(*at.T).all()
    assert at[:, 1].min() < -0.3  # the hill's centre lies to the left of the straight way
    assert at[:, 1].max() < 0.2
    assert path.length_m < 4.0
    np.testing.assert_allclose(path.position([0.0, path.length_m]), ends, atol=1e-9)


def test_a_path_passes_through_every_waypoint() -> None:
    planner = TerrainPlanner(field(hill), CONFIG)
    points = np.array([(-1.5, 0.2), (0.0, -1.2), (1.5, 0.2), (0.0, 1.5)])
    at = looked_at(planner.plan(points))
    nearest = [int(np.argmin(np.hypot(*(at - point).T))) for point in points]
    assert nearest == sorted(nearest)
    np.testing.assert_allclose(at[nearest], points, atol=0.011)


def test_a_blocked_pair_is_named() -> None:
    planner = TerrainPlanner(field(ridge), CONFIG)
    points = [(-1.5, 0.0), (-1.5, 1.0), (1.5, 1.0)]
    for ask in (partial(whole_path, planner), planner.plan):
        with pytest.raises(InputError) as error:
            ask(points)
        line, *_ = error.value.faults
        assert line.startswith("waypoint 2 (1.50, 1.00) cannot be reached from waypoint 1 (-1.50, ")
        assert "slope of 20.1 deg" in line


def test_the_spline_is_checked_again_and_held_to_the_polygon() -> None:
    # a corridor with a sharp bend: the polygon is safe, the plain cubic through its corners is not
    def corridor(x, y):
        free = (abs(x) < 0.5) & (y < 1.0) | (abs(y - 0.6) < 0.4) & (x > -0.5)
        return np.where(free, 0.0, 0.5)

    config = PlannerConfig(
        variance_window_m=0.1, slope_window_m=0.1, node_spacing_m=0.1, edge_margin_m=0.1,
        # or the polygon keeps to the middle, and the cubic with it
        clearance_weight=0.0, side_weight=0.0, climb_weight=0.0,
    )  # fmt: skip
    planner = TerrainPlanner(field(corridor), config)
    points = np.array([(0.0, -1.7), (0.33, 0.85), (1.7, 0.35)])
    corners = at_once(planner._polygon(points, planner.graph))
    assert not planner.relief.safe(*looked_at(SplinePath(corners)).T).all()
    there, back = planner.plan(points), planner.plan(points[::-1])
    assert planner.relief.safe(*looked_at(there).T).all()
    # sides on both sides of an unsafe place are halved: the way back is the same
    share = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(
        back.position((1.0 - share) * back.length_m),
        there.position(share * there.length_m),
        atol=1e-3,
    )


def test_bad_places_are_named_with_the_nearest_safe_one() -> None:
    planner = TerrainPlanner(field(hill), CONFIG)
    with pytest.raises(InputError) as error:
        planner.plan([(-1.9, 0.0), (5.0, 0.0), (0.3, 0.2), (1.5, 0.0)])
    start, outside, steep, advice = error.value.faults
    assert advice == "to use these points: move a waypoint; no higher limit joins them"
    assert start.startswith("start (-1.90, 0.00) is within 0.3 m of the world's border")
    assert outside.startswith("waypoint 1 (5.00, 0.00) is outside the world, 4.0 m by 4.0 m")
    with pytest.raises(InputError, match=r"^waypoint 7 \(5\.00, 0\.00\) is outside the world"):
        whole_path(planner, [(0.0, 0.0), (5.0, 0.0)], number=7)
    assert "waypoint 2 (0.30, 0.20) is on unsafe ground: slope 3" in steep
    x, y = (float(number) for number in steep.rsplit("(", 1)[1].strip(")").split(","))
    assert planner.relief.safe(x, y)
    assert np.hypot(x - 0.3, y - 0.2) < 1.0


@pytest.mark.parametrize("head", [(-1.95, 0.3), (-2.4, 0.0), (-0.1, 0.1)])
def test_a_path_is_laid_again_from_wherever_the_head_is(head: tuple[float, float]) -> None:
    planner = TerrainPlanner(field(hill), CONFIG)
    goal = (1.5, 0.0)
    with pytest.raises(InputError, match="start"):
        planner.plan([head, goal])
    path = whole_path(planner, [head, goal])
    np.testing.assert_allclose(path.position([0.0, path.length_m]), [head, goal], atol=1e-9)
    safe = planner.relief.safe(*looked_at(path).T)
    first = int(np.argmax(safe))
    assert first * 0.01 < 1.3  # straight out of the bad place
    assert safe[first + 2 :].all()


def test_it_is_deterministic_and_forgets_nothing() -> None:
    ground = field(hill)
    points = [(-1.5, 0.0), (1.5, 0.0), (0.0, 1.5)]
    planner = TerrainPlanner(ground, CONFIG)
    first = looked_at(whole_path(planner, points))
    whole_path(planner, [(0.5, -1.0), (0.0, 1.5)])
    np.testing.assert_array_equal(looked_at(whole_path(planner, points)), first)
    np.testing.assert_array_equal(
        looked_at(whole_path(TerrainPlanner(ground, CONFIG), points)), first
    )


def test_a_path_keeps_a_footprint_off_a_place_to_avoid_where_it_can() -> None:
    planner = TerrainPlanner(field(lambda x, y: 0.0 * x), CONFIG)
    ends, place = [(-1.5, 0.0), (1.5, 0.0)], np.array([0.0, 0.0])
    plain, around = (
        looked_at(whole_path(planner, ends)),
        looked_at(whole_path(planner, ends, avoid_m=[place])),
    )
    assert np.hypot(*(plain - place).T).min() < 0.02
    assert np.hypot(*(around - place).T).min() > 0.7 * CONFIG.footprint_m
    np.testing.assert_array_equal(looked_at(whole_path(planner, ends)), plain)
    through = looked_at(
        whole_path(planner, [*ends, (0.0, 0.0)], avoid_m=[place])
    )  # there is no other way
    assert np.hypot(*(through - place).T).min() < 0.02


def test_no_safe_ground_at_all_is_said() -> None:
    planner = TerrainPlanner(field(lambda x, y: x), CONFIG)
    with pytest.raises(InputError, match="no safe ground at all"):
        whole_path(planner, [(0, 0), (1, 1)])


def test_sharpest_bend_of_a_circle_is_its_radius() -> None:
    turn = np.linspace(0.0, 1.5 * np.pi, 300)  # many: a natural end disturbs the first few
    circle = SplinePath(0.7 * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    assert sharpest_bend(circle)[0] == pytest.approx(0.7, rel=0.05)
    assert sharpest_bend(SplinePath([(0, 0), (1, 2)]))[0] > 1e3


def test_widening_keeps_what_is_fixed_and_what_is_safe() -> None:
    points = np.array([(0.0, 0.0), (1.0, 0.0), (1.1, 0.15), (1.0, 0.3), (2.0, 1.0)])
    free = np.array([False, True, True, True, False])
    before = sharpest_bend(SplinePath(points))[0]
    wide = at_once(widen_in_steps(points, free, 0.4, lambda path: True))
    assert sharpest_bend(wide)[0] >= 0.4 > before
    np.testing.assert_allclose(wide.position([0.0, wide.length_m]), points[[0, -1]], atol=1e-9)
    same = at_once(widen_in_steps(points, free, 0.4, lambda path: False))
    np.testing.assert_array_equal(looked_at(same), looked_at(SplinePath(points)))


@pytest.mark.parametrize(
    ("run", "least_deg", "most_deg", "bends"),
    [
        ("jacksboro-traverse", 2.0, 8.0, False),
        ("jacksboro-around", 4.0, 8.0, True),
        ("jacksboro-steep", 12.0, 17.0, True),
    ],
)
def test_shipped_runs_on_the_real_model(
    run: str, least_deg: float, most_deg: float, bends: bool
) -> None:
    pytest.importorskip("matplotlib")
    assert run in shipped("runs")
    given = load_run(run)
    world = load_world(given.world)
    planner = TerrainPlanner(build_ground(world), world.planner)
    points = np.vstack([given.start_m, given.waypoints_m])
    path = planner.plan(points)
    relief = path_relief(planner, path)
    assert least_deg < np.degrees(relief.median_slope_rad) <= most_deg
    surface_rad = planner.relief.ground.slope_rad(*path.piece_m(0.0, path.length_m).T)
    assert least_deg < np.degrees(np.median(surface_rad)) <= most_deg
    assert slopes_rad(planner, path).max() <= world.planner.slope_limit_rad
    assert relief.world_median_slope_rad > relief.median_slope_rad
    assert sharpest_bend(path)[0] >= world.planner.bend_radius_m
    assert 5.0 < relief.length_m < 7.0
    plain = SplinePath(points)
    assert (slopes_rad(planner, plain).max() > world.planner.slope_limit_rad) == bends
    # the body lies behind the head at the start
    heading = path.heading_rad(0.05)
    behind = points[0] - np.linspace(0, 1.25, 30)[:, None] * [np.cos(heading), np.sin(heading)]
    assert planner.relief.safe(*behind.T).all()


@pytest.mark.parametrize(
    "run",
    ["ramp-10-up", "ramp-10-along", "ramp-15-up", "random-10", "steps-4cm", "gaps-8cm"],
)
def test_shipped_runs_on_made_ground_have_a_safe_path(run: str) -> None:
    given = load_run(run)
    world = load_world(given.world)
    planner = TerrainPlanner(build_ground(world), world.planner)
    path = planner.plan(np.vstack([given.start_m, given.waypoints_m]))
    assert 5.0 < path.length_m < 6.5
    assert planner.relief is not None
    assert planner.relief.safe(*looked_at(path).T).all()


def test_a_path_goes_around_what_is_unknown_and_a_waypoint_in_it_is_refused() -> None:
    ground = field(lambda x, y: 0.0 * x)
    x, y = np.meshgrid(*2 * [np.linspace(-2.0, 2.0, ground.z_m.shape[0])])
    hole = np.hypot(x, y - 0.1) < 0.4
    planner = TerrainPlanner(replace(ground, known=~hole), CONFIG)
    path = looked_at(planner.plan([(-1.5, 0.0), (1.5, 0.0)]))
    assert np.hypot(path[:, 0], path[:, 1] - 0.1).min() > 0.4 + 0.5 * CONFIG.slope_window_m
    with pytest.raises(InputError, match=r"within 0.1 m of ground that the world's map does not"):
        planner.plan([(-1.5, 0.0), (0.1, 0.1)])
    wall = TerrainPlanner(replace(ground, known=np.abs(x) > 0.2), CONFIG)
    with pytest.raises(InputError, match=r"points: the world's map does not know"):
        wall.plan([(-1.5, 0.0), (1.5, 0.0)])


def test_the_advice_for_a_beach_that_varies_too_much_opens_a_way() -> None:
    beach = field(lambda x, y: np.clip(0.25 * x, -0.2, 0.2))
    points = [(-1.5, 0.0), (1.5, 0.0)]
    with pytest.raises(InputError, match=r": --set world\.planner\.variance_limit_m2=0\.0015$"):
        TerrainPlanner(beach, CONFIG).plan(points)
    TerrainPlanner(beach, CONFIG.model_copy(update={"variance_limit_m2": 0.0015})).plan(points)


def test_a_path_from_elsewhere_goes_onto_one_that_was_planned_from_the_next_point_on() -> None:
    planner = TerrainPlanner(None, PlannerConfig())
    onward = whole_path(planner, [(2.0, 0.0), (4.0, 1.0)])
    path = whole_path(planner, [(0.0, 0.5), (2.0, 0.0), (4.0, 1.0)], 0.0)
    np.testing.assert_allclose(
        path.position([0.0, path.length_m]), [(0.0, 0.5), (4.0, 1.0)], atol=1e-9
    )
    rest_m = path.piece_m(path.length_m - 0.5 * onward.length_m, path.length_m)
    planned_m = onward.piece_m(0.0, onward.length_m)
    assert max(np.hypot(*(planned_m - at).T).min() for at in rest_m) < 0.02


def drawn_points(seed: int) -> np.ndarray:
    """(n, 2) points of which some are equal, or within a few steps of a path's table."""
    rng = np.random.default_rng(seed)
    start, other = rng.uniform(-1.2, -0.8, 2), rng.uniform(0.8, 1.2, 2)
    away_m = rng.choice([0.0, 1e-9, 0.001, 0.005, 0.0099, 0.0101, 0.012, 0.015, 0.02, 0.05])
    angle = rng.choice([0.0, 0.5, 1.0, 1.5]) * np.pi + np.arctan2(*(other - start)[::-1])
    step = away_m * np.array([np.cos(angle), np.sin(angle)])
    orders = [
        [start, start + step],
        [start, start + step, other],
        [start, other, other + step],
        [start, other, other + step, start],
        [start, other, start + step],
        [start, start + step, start, start + step],
    ]
    return np.array(orders[rng.integers(len(orders))])


@pytest.mark.slow
def test_close_waypoints_give_a_path_or_a_fault_that_says_what_to_write() -> None:
    """80 draws: next to the start or to each other, on flat ground and hills, from any heading."""
    planners = TerrainPlanner(None, CONFIG), TerrainPlanner(field(hill, spacing=0.1), CONFIG)
    paths, faults = 0, []
    for seed in range(80):
        points, planner = drawn_points(seed), planners[seed % 4 == 0]
        heading = None if seed % 5 else 0.1 * seed
        try:
            path = whole_path(planner, points, heading)
        except InputError as error:
            faults.append((np.hypot(*(points - points[0]).T).max(), str(error)))
        else:
            passes_m = path.position(path.passes(points[1:]))
            assert np.hypot(*(passes_m - points[1:]).T).max() < 0.021
            paths += 1
    assert paths > 60
    for farthest_m, fault in faults:
        assert farthest_m < 0.021
        assert "farther than 1 cm from start (" in fault
        assert fault.endswith("; move or add one")


def test_a_fault_names_waypoints_by_their_number_in_the_file() -> None:
    """A waypoint that is dropped because it is next to the start still counts."""
    points = np.array([(-1.5, -0.3), (-1.5, -0.301), (0.0, 9.0)])
    with pytest.raises(InputError, match=r"waypoint 2 \(0\.00, 9\.00\) is outside"):
        whole_path(TerrainPlanner(field(hill, spacing=0.1), CONFIG), points)
