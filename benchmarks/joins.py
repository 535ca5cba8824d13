"""Joins planned inside a control cycle: any gait to any other, by both ways of changing gait.

A join is all that the cycle does for it beyond a step: the new gait looked at over its cycle, the
way to it chosen. CPU time, the least of some tries at each pair of gaits; every try starts from the
same moment of the old gait, and the pairs take turns, so that other work on the machine meets few
of a pair's tries.
"""

import time
from collections.abc import Callable
from copy import deepcopy
from itertools import product

import numpy as np

from benchmarks.rows import Row
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.motion.cpg_motion import CpgMotion
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.gait_motion import GaitMotion

TITLE = "Joins inside a control cycle: every gait of alternating16 to every other"

PERIOD_S = 0.02
TARGET = 0.25
"""Of a period, for the worst pair."""
TRIES = 5
MOMENTS_S = (0.46, 2.0)
"""Of the old gait: in the middle of its own start, and later."""

Motion = GaitMotion | CpgMotion


def run() -> list[Row]:
    """Measure."""
    robot = load_robot("alternating16")
    ways: dict[str, Callable[[Gait, RobotConfig], Motion]] = {
        "blend": GaitMotion,
        "cpg": _oscillators,
    }
    rows = []
    for way, make in ways.items():
        pairs = [
            (_gone(make(GAITS[one](), robot), moment_s), GAITS[other])
            for one, other in product(GAITS, GAITS)
            for moment_s in MOMENTS_S
        ]
        tries_s = [[join_s(motion, other()) for motion, other in pairs] for _ in range(TRIES)]
        cost_s = np.min(tries_s, axis=0)
        for what, value_s, target in (
            ("median", float(np.median(cost_s)), None),
            ("worst", float(cost_s.max()), TARGET),
        ):
            ratio = value_s / PERIOD_S
            rows.append(Row(f"{way}, {what}", value_s * 1e3, "ms", "20 ms", ratio, target))
    return rows


def join_s(motion: Motion, other: Gait) -> float:
    """CPU time in which a copy of ``motion`` is joined to a gait."""
    fresh = deepcopy(motion)
    begun = time.process_time()
    fresh.become(other)
    return time.process_time() - begun


def _gone(motion: Motion, time_s: float) -> Motion:
    for _ in range(round(time_s / PERIOD_S)):
        motion.step(PERIOD_S, None)  # type: ignore[arg-type]
    return motion


def _oscillators(gait: Gait, robot: RobotConfig) -> CpgMotion:
    motion = CpgMotion(robot, GaitCycle(gait, robot).goal_rad())
    motion.become(gait)
    return motion
