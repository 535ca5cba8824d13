"""A path that failed is planned again over several cycles, with the result of one piece."""

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.runtime.forecast import forecast
from snakewalk.controller.terrain.dijkstra import shortest_tree
from snakewalk.controller.terrain.in_steps import Steps, Unfinished, at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.replanning import UNITS_PER_CYCLE
from tests.helpers.planned import whole_path

WAYPOINTS = [(2.0, 0.0), (4.0, 1.0)]
_prepared = cache(prepare_job)


class SlowPlans:
    """Plans straight pieces in ten steps of a cycle's work each."""

    def __init__(self) -> None:
        self.has_way = True

    def in_steps(self, points_m, heading_rad=None, *, avoid_m=(), number=1) -> Steps[SplinePath]:
        for _ in range(10):
            yield UNITS_PER_CYCLE
        if not self.has_way:
            raise InputError("no way")
        return SplinePath(points_m)


def course(plan: SlowPlans) -> Course:
    return Course(
        plan.in_steps,
        WAYPOINTS,
        start_m=np.zeros(2),
        radius_m=0.3,
        length_m=1.2,
        travel_per_body=100.0,
    )


def off_the_path(on: Course, travel: float = 1000.0) -> None:
    on.follow(np.array([1.0, 1.5]), np.array([1.5, 1.5]), lambda: 0.3, travel)


def planned(on: Course) -> int:
    cycles = 0
    while on.is_planning:
        on.continue_planning()
        cycles += 1
    return cycles


def test_the_old_path_stays_in_force_until_the_new_one_is_planned() -> None:
    on = course(SlowPlans())
    before = on.path
    off_the_path(on)
    for _ in range(9):
        assert on.is_planning
        on.continue_planning()
        off_the_path(on)
        assert on.path is before
        assert (on.missed, on.replanned) == (0, None)
    assert planned(on) == 1
    assert on.missed == 1
    assert on.replanned == "1.58 m off the path"
    np.testing.assert_allclose(on.path.position(0.0), [1.5, 1.5])
    off_the_path(on)
    assert on.replanned is None


def test_without_a_safe_path_the_old_one_stays_and_the_miss_counts() -> None:
    plan = SlowPlans()
    on, lost = course(plan), list[bool]()
    before, plan.has_way = on.path, False
    for missed in (1, 2):
        off_the_path(on, 1000.0 * missed)
        while on.is_planning:
            on.continue_planning(lost.append)
        assert on.path is before
        assert on.missed == missed
    assert lost == [False, True]


def test_a_waypoint_that_is_reached_meanwhile_ends_the_planning() -> None:
    on = course(SlowPlans())
    off_the_path(on)
    on.continue_planning()
    on.follow(np.array([1.9, 0.0]), np.array([2.4, 0.0]), lambda: 0.0, 1001.0)
    assert (on.reached, on.missed, on.is_planning) == (1, 0, False)


def requests(planner: TerrainPlanner, path: SplinePath, waypoints_m: np.ndarray) -> Iterator[tuple]:
    rng = np.random.default_rng(7)
    for avoids in (False, True):
        at_m = path.length_m * (0.2 + 0.3 * avoids)
        left_m = waypoints_m[int((np.array(path.passes(waypoints_m)) < at_m).sum()) :]
        points_m = np.vstack([path.position(at_m) + 0.1 * rng.standard_normal(2), left_m])
        avoid_m = path.position([at_m + 0.2]) if avoids else np.empty((0, 2))
        yield points_m, path.heading_rad(at_m) + 2.0, avoid_m


@pytest.mark.parametrize("job", ["flat-slalom", "jacksboro-traverse"])
def test_planned_in_steps_it_is_the_path_of_one_piece(job: str) -> None:
    run = _prepared(job)
    assert isinstance(run, WalkRun)
    planner, waypoints_m = run.planner, np.array(run.run.waypoints_m)
    for points_m, heading_rad, avoid_m in requests(planner, run.path, waypoints_m):
        whole = whole_path(planner, points_m, heading_rad, avoid_m=avoid_m)
        part = Unfinished(planner.in_steps(points_m, heading_rad, avoid_m=avoid_m))
        cycles = 1
        while not part.carry_on(UNITS_PER_CYCLE):
            cycles += 1
        assert part.result is not None
        np.testing.assert_array_equal(part.result._points, whole._points)
        assert part.largest <= UNITS_PER_CYCLE
        assert cycles > 5


def test_a_cycle_in_which_the_walk_thinks_does_not_plan() -> None:
    run = _prepared("flat-slalom")
    assert isinstance(run, WalkRun)
    pilot = run.pilot(level=True)
    chooser, on = pilot._chooser, pilot.course
    think, decide, plan = chooser.think, chooser.decide, on.continue_planning
    work, replanned, planned_cycles = list[str](), 0, 0
    step = Pilot.step

    def counted_think(look):
        goes_on = think(look)
        work.extend(["think"] if goes_on else [])
        return goes_on

    def counted_decide(pose):
        work.append("decide")
        return decide(pose)

    def counted_plan(fall_back):
        work.extend(["plan"] if on.is_planning else [])
        plan(fall_back)

    def checked_step(self, dt_s, view):
        nonlocal replanned, planned_cycles
        work.clear()
        goal = step(self, dt_s, view)
        assert "plan" not in work or work == ["plan"]
        planned_cycles += "plan" in work
        replanned += self.replanned is not None
        return goal

    on._failing = lambda centre_m: "forced"
    chooser.think, chooser.decide, on.continue_planning = (
        counted_think,
        counted_decide,
        counted_plan,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Pilot, "step", checked_step)
        forecast(
            *(pilot, run.robot, run.world.friction),
            start_m=np.zeros(2), heading_rad=run.start_heading_rad, ground=None, limit_s=12.0,
        )  # fmt: skip
    assert replanned >= 2
    assert planned_cycles >= 6 * replanned


def test_a_tree_in_steps_has_the_distances_of_scipy() -> None:
    from scipy.sparse import random_array
    from scipy.sparse.csgraph import dijkstra

    graph = random_array((1500, 1500), density=0.004, rng=np.random.default_rng(3), format="csr")
    found, before = at_once(
        shortest_tree(graph.indptr.astype(np.int64), graph.indices.astype(np.int64), graph.data, 17)
    )
    expected, _ = dijkstra(graph, indices=[17], return_predecessors=True)
    np.testing.assert_allclose(found, expected[0], rtol=1e-12)
    reached = np.flatnonzero(np.isfinite(found))
    for node in reached[reached != 17].tolist():
        step = graph[[before[node]], [node]]
        assert found[node] == found[before[node]] + float(np.asarray(step).ravel()[0])
    assert (before[~np.isfinite(found)] == -9999).all()
