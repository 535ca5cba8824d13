"""Replanning in the control cycle: 20 runs, each with a forced miss every four seconds.

The CPU time of the motion's step in cycles that plan, over its longest in the other cycles of the
same run. The runs have no second body, as on a port.

python -m benchmarks replanning
"""

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.rows import Row
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.pilot import Pilot

TITLE = "Replanning in the control cycle"

JOBS = ("flat-slalom", "jacksboro-traverse", "jacksboro-around", "random-10", "ramp-10-up")
SEEDS = range(4)
LIMIT_S = 20.0
MOST = 1.3


def run() -> list[Row]:
    """Measure."""
    rows = []
    for job in JOBS:
        ratios, plans, longest_s, cycles = [], 0, 0.0, []
        for seed in SEEDS:
            planning_s, other_s, delays = _walk(job, seed)
            ratios.append(float(np.max(planning_s) / np.max(other_s)))
            longest_s = max(longest_s, float(np.max(planning_s)))
            plans += len(delays)
            cycles += delays
        what = f"{job}: longest cycle that plans, {len(ratios)} runs, {plans} plans"
        against = "the longest other cycle of its run"
        rows.append(Row(what, 1e3 * longest_s, "ms", against, max(ratios), MOST))
        rows.append(Row(f"{job}: cycles until a path is planned", float(np.max(cycles)), "at most"))
    return rows


def _walk(job: str, seed: int) -> tuple[list[float], list[float], list[int]]:
    """CPU times of steps that plan, and of the others, and the cycles from miss to path."""
    prepared = prepare_job(job, keys={"run.walk.tries": 0, "run.time_limit_s": LIMIT_S}, seed=seed)
    planning_s, other_s, delays, waiting = list[float](), list[float](), list[int](), 0
    step = Pilot.step

    def timed(pilot: Pilot, dt_s: float, view: object) -> object:
        nonlocal waiting
        plans = pilot.course.is_planning
        start_s = time.thread_time()
        goal = step(pilot, dt_s, view)  # type: ignore[arg-type]
        took_s = time.thread_time() - start_s
        (planning_s if plans or pilot.course.is_planning else other_s).append(took_s)
        waiting = waiting + 1 if plans else 0
        if plans and not pilot.course.is_planning:
            delays.append(waiting)
        return goal

    Pilot.step = timed  # type: ignore[method-assign, assignment]
    try:
        with tempfile.TemporaryDirectory() as folder, _forced_misses():
            run_robot(RunRequest(prepared, Path(folder) / "run"))
    finally:
        Pilot.step = step  # type: ignore[method-assign]
    return planning_s, other_s, delays


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
