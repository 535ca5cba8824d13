"""The search over sequences of arcs, whose ends are closed forms."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.controller.repertoire.search import MotionPrimitives, search

SHORT, LONG, LEFT, RIGHT = range(4)
TURN_RAD = 0.5


def arc(kind: str, length_m: float, turn_rad: float, duration_s: float) -> Any:
    """A segment that moves along an arc."""
    share = np.linspace(0.0, 1.0, 101)
    turn = turn_rad * share
    chord = length_m * share * np.sinc(0.5 * turn / np.pi)
    travel = np.column_stack([chord * np.cos(0.5 * turn), chord * np.sin(0.5 * turn), turn])
    return SimpleNamespace(kind=kind, duration_s=duration_s, flat_travel=lambda: travel)


ARCS: Any = SimpleNamespace(
    segments=[
        arc("forward", 0.1, 0.0, 1.0),
        arc("forward", 0.2, 0.0, 3.0),  # fewer cycles and more time
        arc("left", 0.1, TURN_RAD, 1.0),
        arc("right", 0.1, -TURN_RAD, 1.0),
        arc("rest", 0.0, 0.0, 1.0),
    ]
)
PRIMITIVES = MotionPrimitives(ARCS)


def passed(poses: Floats, actions: tuple[int, ...], goals: list[tuple[float, float]]) -> list[int]:
    """Cycle in which the dense path first comes within 5 cm of each goal, in order."""
    cycles = []
    for cycle, (pose, action) in enumerate(zip(poses, actions, strict=False)):
        x, y, _ = ARCS.segments[action].flat_travel().T
        c, s = np.cos(pose[2]), np.sin(pose[2])
        path = np.column_stack([pose[0] + c * x - s * y, pose[1] + s * x + c * y])
        while len(cycles) < len(goals) and (
            np.hypot(*(path - goals[len(cycles)]).T).min() < 0.0501
        ):
            cycles.append(cycle)
    return cycles


def test_the_quickest_sequence_is_found_although_another_has_fewer_cycles() -> None:
    route = search(PRIMITIVES, [0.0, 0.0, 0.0], [(1.0, 0.0)], 0.04)
    assert route.actions == (SHORT,) * 10
    assert (route.reached, route.duration_s) == (1, 10.0)
    np.testing.assert_allclose(route.pose[:, 0], 0.1 * np.arange(11), atol=1e-12)


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.4)])
def test_a_route_is_a_chain_of_arcs_through_the_waypoints_in_order(
    start: tuple[float, float, float],
) -> None:
    goals = [(0.7, 0.3), (0.6, 0.9), (0.1, 1.0)]
    route = search(PRIMITIVES, start, goals, 0.05)
    assert route.reached == 3
    assert route.duration_s == PRIMITIVES.duration_s[list(route.actions)].sum()
    np.testing.assert_array_equal(route.pose[0], start)
    for pose, action, after in zip(route.pose, route.actions, route.pose[1:], strict=False):
        np.testing.assert_allclose(PRIMITIVES.after(pose, action), after, atol=1e-12)
    cycles = passed(route.pose, route.actions, goals)
    assert len(cycles) == 3
    assert cycles[-1] == len(route.actions) - 1, "it ends with the last waypoint"


def test_mirrored_waypoints_have_the_mirrored_route() -> None:
    goals = [(0.5, 0.4), (0.2, 0.9)]
    route = search(PRIMITIVES, np.zeros(3), goals, 0.05)
    mirrored = search(PRIMITIVES, np.zeros(3), [(x, -y) for x, y in goals], 0.05)
    swapped = {LEFT: RIGHT, RIGHT: LEFT}
    assert route.reached == mirrored.reached == 2
    assert mirrored.duration_s == route.duration_s
    assert LEFT in route.actions
    assert RIGHT in [swapped.get(action, action) for action in route.actions]
    np.testing.assert_allclose(np.abs(mirrored.pose[-1, 1]), np.abs(route.pose[-1, 1]), atol=0.05)


def test_a_waypoint_beyond_the_depth_is_approached() -> None:
    route = search(PRIMITIVES, np.zeros(3), [(5.0, 0.0)], 0.05, depth=3)
    assert (route.reached, len(route.actions)) == (0, 3)
    assert route.pose[-1, 0] >= 0.3
