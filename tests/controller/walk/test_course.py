"""A course whose path is renewed while the body is on it: more ground, or other waypoints."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.walk.course import Course

WAYPOINTS = [(2.0, 0.0), (4.0, 1.0)]


class Plans:
    """Plans straight pieces, no farther than ``reach_m`` in x."""

    def __init__(self, reach_m: float) -> None:
        self.reach_m = reach_m
        self.asked: list[np.ndarray] = []

    def __call__(self, points_m, heading_rad=None, *, avoid_m=(), number=1) -> Steps[SplinePath]:
        yield 1
        points = np.asarray(points_m, float)
        self.asked.append(points)
        within = points[points[:, 0] <= self.reach_m]
        if len(within) < len(points):
            after = points[len(within)]
            share = (self.reach_m - within[-1][0]) / (after[0] - within[-1][0])
            within = np.vstack([within, within[-1] + share * (after - within[-1])])
        return SplinePath(within)


def course(plan: Callable[..., Steps[SplinePath]]) -> Course:
    return Course(
        plan, WAYPOINTS, start_m=np.zeros(2), radius_m=0.3, length_m=1.2, travel_per_body=100.0
    )


def walked(on: Course, head_x_m: float) -> None:
    on.follow(np.array([head_x_m - 0.6, 0.0]), np.array([head_x_m, 0.0]), lambda: 0.0, 0.0)


def planned(on: Course) -> None:
    while on.is_planning:
        on.continue_planning()


def test_a_path_that_ends_before_a_waypoint_does_not_pass_it_by() -> None:
    on = course(Plans(1.2))
    assert on.path.length_m == pytest.approx(1.2)
    for x in np.arange(0.0, 1.8, 0.1):
        walked(on, float(x))
    assert on.replanned is None
    assert on.missed == 0
    np.testing.assert_allclose(on.ahead_m(2.5), [1.2, 0.0])


def test_renewed_it_keeps_the_piece_under_the_body_and_goes_on_from_there() -> None:
    plan = Plans(1.2)
    on = course(plan)
    walked(on, 0.8)
    before = on.path.piece_m(0.0, 1.0)
    plan.reach_m = 3.0
    on.renew("more", lambda points: True, lambda: 0.0)
    assert on.replanned == "more"
    assert on.missed == 0
    np.testing.assert_allclose(plan.asked[-1][0], [1.1, 0.0], atol=0.01)
    np.testing.assert_allclose(on.path.piece_m(0.0, 1.0), before, atol=1e-6)
    assert on.path.position(on.path.length_m)[0] == pytest.approx(3.0)
    assert on.head_along_m == pytest.approx(0.8, abs=0.01)
    walked(on, 2.6)  # the centre is at the first waypoint
    assert on.reached == 1
    plan.reach_m = 9.0
    on.renew("more", lambda points: True, lambda: 0.0)
    assert len(plan.asked[-1]) == 2  # the waypoint under the body is not asked for again
    np.testing.assert_allclose(on.path.position(on.path.length_m), WAYPOINTS[1])


def test_a_piece_that_is_not_clear_is_left_from_the_head_on() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 0.8)
    on.renew("unsafe", lambda points: False, lambda: 0.3)
    np.testing.assert_allclose(plan.asked[-1][0], [0.8, 0.0])
    assert on.head_along_m == 0.0


def test_where_no_path_is_found_the_old_one_stays() -> None:
    plan = Plans(1.2)
    on = course(plan)
    walked(on, 0.5)
    path = on.path

    def refuses(points_m, heading_rad=None, *, avoid_m=(), number=1) -> SplinePath:
        raise InputError("no way")

    on._plan = refuses
    on.renew("more", lambda points: True, lambda: 0.0)
    assert on.path is path
    assert on.replanned is None


def test_with_the_path_over_every_waypoint_behind_there_is_nothing_to_renew() -> None:
    plan = Plans(9.0)
    on = course(plan)
    for x in np.arange(0.0, 4.2, 0.2):
        on.observe(np.array([0.0, 5.0]), np.array([x, min(0.5 * max(x - 2.0, 0.0), 1.0)]))
    count = len(plan.asked)
    on.renew("more", lambda points: True, lambda: 0.0)
    assert len(plan.asked) == count


def test_a_waypoint_more_goes_on_from_the_paths_end_and_keeps_what_is_before_it() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 0.8)
    before = on.path.piece_m(0.0, on.path.length_m)
    on.lead_to(np.array([*WAYPOINTS, (5.0, 2.0)]), lambda: 0.0)
    np.testing.assert_allclose(plan.asked[-1][[0, -1]], [WAYPOINTS[1], (5.0, 2.0)])
    np.testing.assert_allclose(
        on.path.piece_m(0.0, on.path.length_m)[: len(before)], before, atol=2e-2
    )
    np.testing.assert_allclose(on.path.position(on.path.length_m), (5.0, 2.0))
    assert on.head_along_m == pytest.approx(0.8, abs=0.01)
    assert len(on.waypoints_m) == 3
    assert not on.complete


def test_another_waypoint_instead_is_led_to_from_the_head() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 2.6)  # the centre is at the first waypoint
    assert on.reached == 1
    on.lead_to(np.array([(1.0, 3.0)]), lambda: 0.4)
    np.testing.assert_allclose(plan.asked[-1], [(2.6, 0.0), (1.0, 3.0)])
    np.testing.assert_allclose(on.waypoints_m, [WAYPOINTS[0], (1.0, 3.0)])
    on.observe(np.array([1.0, 2.9]), np.array([1.0, 3.5]))
    assert on.complete


def test_with_what_is_left_left_out_it_is_complete_and_another_may_follow() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 0.8)
    path = on.path
    on.lead_to(np.zeros((0, 2)), lambda: 0.0)
    assert on.complete
    assert on.path is path
    walked(on, 0.9)
    on.lead_to(np.array([(3.0, 1.0)]), lambda: 0.0)
    assert not on.complete
    np.testing.assert_allclose(plan.asked[-1][0], [0.9, 0.0])


def test_waypoints_that_no_path_leads_to_change_nothing() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 0.8)
    path, waypoints_m = on.path, on.waypoints_m
    numbers = []

    def refuses(points_m, heading_rad=None, *, avoid_m=(), number=1) -> SplinePath:
        numbers.append(number)
        raise InputError("no way")

    on._plan = refuses
    for left_m in ([*WAYPOINTS, (5.0, 2.0)], [(5.0, 2.0)]):
        with pytest.raises(InputError):
            on.lead_to(np.array(left_m), lambda: 0.0)
        assert on.path is path
        assert on.waypoints_m is waypoints_m
    assert numbers == [3, 1]


def test_one_more_after_one_more_goes_on_from_the_last() -> None:
    plan = Plans(9.0)
    on = course(plan)
    walked(on, 0.8)
    chance, left_m = np.random.default_rng(0), list(WAYPOINTS)
    for _ in range(20):
        left_m.append(tuple(chance.uniform(-3.0, 3.0, 2)))
        on.lead_to(np.array(left_m), lambda: 0.0)
        np.testing.assert_allclose(plan.asked[-1], left_m[-2:], atol=1e-9)
    assert on.leads_on


def test_a_path_from_here_begins_at_the_head_and_is_no_miss() -> None:
    plan = Plans(9.0)
    on = course(plan)
    on.follow(np.array([0.0, 0.5]), np.array([0.6, 0.6]), lambda: 0.0, 0.0)
    assert on.off_path_m == pytest.approx(0.5)
    on.lay_from_here("moved aside", lambda: 0.3)
    assert on.is_planning
    planned(on)
    assert on.replanned == "moved aside"
    assert (on.reached, on.missed) == (0, 0)
    np.testing.assert_allclose(plan.asked[-1], [[0.6, 0.6], *WAYPOINTS])
    before = on.path

    def nothing(*args: object, **named: object) -> SplinePath:
        raise InputError("no way")

    on._plan = nothing  # type: ignore[assignment]
    on.lay_from_here("again", lambda: 0.3)
    planned(on)
    assert on.path is before
