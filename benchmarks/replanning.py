"""Replanning in the control cycle: 20 runs, each with a forced miss every four seconds.

The CPU time of the motion's step in cycles that plan, over its longest in the other cycles of the
same run; then the longest of all cycles over the longest of the same run without misses. The runs
have no second body, as on a port. Then 40 drawn grounds: the longest CPU time of
a cycle's planning, for a path from a drawn head with and without drawn stalls.

python -m benchmarks replanning
"""

import gc
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

import numpy as np

from benchmarks.drawn_grounds import KINDS, drawn_ground, drawn_requests
from benchmarks.rows import Row
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.terrain.in_steps import Steps, Unfinished
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.replanning import UNITS_PER_CYCLE

TITLE = "Replanning in the control cycle"

JOBS = ("flat-slalom", "jacksboro-traverse", "jacksboro-around", "random-10", "ramp-10-up")
SEEDS = range(4)
LIMIT_S = 20.0
MOST = 1.3
GROUNDS = 40
PASSES = 3
"""Passes of the same steps: a busy machine delays single cycles, other ones each time."""
MOST_S = 5e-3
Misses = Callable[[], AbstractContextManager[None]]


def run() -> list[Row]:
    """Measure."""
    rows = []
    for job in JOBS:
        ratios, plans, longest_s, cycles, with_s, without_s = [], 0, 0.0, [], [], []
        for seed in SEEDS:
            steps_s, plans_at, delays = _walk(job, seed, _forced_misses)
            planning_s, other_s = steps_s[plans_at], steps_s[~plans_at]
            with_s.append(longest_s_of(job, seed, _forced_misses))
            without_s.append(longest_s_of(job, seed, nullcontext))
            ratios.append(float(np.max(planning_s) / np.max(other_s)))
            longest_s = max(longest_s, float(np.max(planning_s)))
            plans += len(delays)
            cycles += delays
        what = f"{job}: longest cycle that plans, {len(ratios)} runs, {plans} plans"
        against = "the longest other cycle of its run"
        rows.append(Row(what, 1e3 * longest_s, "ms", against, max(ratios), MOST))
        rows.append(Row(f"{job}: cycles until a path is planned", float(np.max(cycles)), "at most"))
        worst = float(np.max(np.divide(with_s, without_s)))
        against = "the longest of the same run without misses"
        what = f"{job}: longest cycle with misses"
        rows.append(Row(what, 1e3 * max(with_s), "ms", against, worst, MOST))
    return rows + _drawn_rows()


def _drawn_rows() -> list[Row]:
    """Longest planning in a cycle on the drawn grounds of each kind."""
    rows = []
    for kind in KINDS:
        longest_s, cycles, counts = 0.0, 0, [0, 0]
        for seed in range(GROUNDS):
            drawn_kind, ground, config = drawn_ground(seed)
            if drawn_kind != kind:
                continue
            for steps_s, is_planned in _repeated_steps(seed, ground, config):
                longest_s, cycles = max(longest_s, *steps_s), max(cycles, len(steps_s))
                counts[is_planned] += 1
        what = f"{kind}: longest planning in a cycle, {counts[1]} paths, {counts[0]} without a way"
        ratio = longest_s / MOST_S
        rows.append(Row(what, 1e3 * longest_s, "ms", f"{1e3 * MOST_S:g} ms", ratio, 1.0))
        rows.append(Row(f"{kind}: cycles until a path is planned", float(cycles), "at most"))
    return rows


def _repeated_steps(
    seed: int, ground: HeightField, config: PlannerConfig
) -> Iterator[tuple[list[float], bool]]:
    """Yield the least CPU times of each request's cycles, of three passes of the same steps."""
    passes = [
        [timed_steps(request) for request in drawn_requests(seed, TerrainPlanner(ground, config))]
        for _ in range(PASSES)
    ]
    for same in zip(*passes, strict=True):
        each_s = [steps_s for steps_s, _ in same]
        assert len({len(steps_s) for steps_s in each_s}) == 1
        yield [min(step) for step in zip(*each_s, strict=True)], same[0][1]


def timed_steps(steps: Steps[SplinePath]) -> tuple[list[float], bool]:
    """CPU time of each cycle of a planning, and whether it ended with a path.

    Objects before it are excluded from garbage collections, as in a run.
    """
    gc.collect()
    gc.freeze()
    try:
        return _timed_steps(steps)
    finally:
        gc.unfreeze()


def _timed_steps(steps: Steps[SplinePath]) -> tuple[list[float], bool]:
    unfinished, took_s = Unfinished(steps), list[float]()
    while unfinished.result is None:
        start_s = time.thread_time()
        try:
            unfinished.carry_on(UNITS_PER_CYCLE)
        except InputError:
            return [*took_s, time.thread_time() - start_s], False
        took_s.append(time.thread_time() - start_s)
    return took_s, True


def longest_s_of(job: str, seed: int, misses: Misses) -> float:
    """Return the longest step of a run: of three equal runs, the least time of each step counts."""
    passes = [_walk(job, seed, misses)[0] for _ in range(PASSES)]
    return float(np.min(passes, axis=0).max())


def _walk(job: str, seed: int, misses: Misses) -> tuple[Floats, Bools, list[int]]:
    """CPU time of each step, whether it plans, and the cycles from each miss to a path."""
    prepared = prepare_job(job, keys={"run.walk.tries": 0, "run.time_limit_s": LIMIT_S}, seed=seed)
    steps_s, plans_at, delays, waiting = list[float](), list[bool](), list[int](), 0
    step = Pilot.step

    def timed(pilot: Pilot, dt_s: float, view: object) -> object:
        nonlocal waiting
        plans = pilot.course.is_planning
        start_s = time.thread_time()
        goal = step(pilot, dt_s, view)  # type: ignore[arg-type]
        took_s = time.thread_time() - start_s
        steps_s.append(took_s)
        plans_at.append(plans or pilot.course.is_planning)
        waiting = waiting + 1 if plans else 0
        if plans and not pilot.course.is_planning:
            delays.append(waiting)
        return goal

    Pilot.step = timed  # type: ignore[method-assign, assignment]
    try:
        with tempfile.TemporaryDirectory() as folder, misses():
            run_robot(RunRequest(prepared, Path(folder) / "run"))
    finally:
        Pilot.step = step  # type: ignore[method-assign]
    return np.array(steps_s), np.array(plans_at), delays


@contextmanager
def _forced_misses() -> Iterator[None]:
    """Let every path fail as soon as it may; each second time as if the body stood still."""
    failing, stalled, count = Course._failing, Course._body_is_stalled, 0

    def fails(course: Course, centre_m: object) -> str:
        nonlocal count
        count += 1
        return "forced"

    Course._failing = fails  # type: ignore[method-assign, assignment]
    Course._body_is_stalled = property(lambda course: count % 2 == 0)  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        Course._failing, Course._body_is_stalled = failing, stalled  # type: ignore[method-assign]
