"""On drawn grounds, no step of a planning is long, and the result is that of one piece."""

import numpy as np
import pytest

from benchmarks.drawn_grounds import drawn_ground, drawn_requests
from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.in_steps import Unfinished, at_once
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.walk.replanning import UNITS_PER_CYCLE

LONGEST = 2 * UNITS_PER_CYCLE


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "least_cycles", "has_way"), [(31, 400, True), (34, 100, False)])
def test_each_step_is_short_where_all_safe_ground_is_searched(
    seed: int, least_cycles: int, has_way: bool
) -> None:
    _, ground, config = drawn_ground(seed)
    longest_plan = 0
    for steps in drawn_requests(seed, TerrainPlanner(ground, config)):
        plan = Unfinished(steps)
        cycles = 1
        try:
            while not plan.carry_on(UNITS_PER_CYCLE):
                cycles += 1
        except InputError:
            assert not has_way
        assert 0 < plan.largest <= LONGEST
        longest_plan = max(longest_plan, cycles)
    assert least_cycles < longest_plan < 600, "no request needs all safe ground"
    assert has_way == (plan.result is not None)


def test_a_call_advises_and_a_plan_in_steps_does_not() -> None:
    _, ground, config = drawn_ground(34)
    planner = TerrainPlanner(ground, config)
    assert planner.graph is not None
    safe = planner.graph.nodes_m
    points_m = np.array([safe[0], safe[-1]])
    with pytest.raises(InputError, match=r"from .*m2\nto use these points: (--set|move)"):
        planner.plan(points_m)
    with pytest.raises(InputError, match=r"cannot be reached from .*m2$"):
        at_once(planner.in_steps(points_m))
