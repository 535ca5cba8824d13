"""What the shape of a link's belly costs: CPU time of a step of 2 ms, motors and friction included.

A run repeats bit for bit, so each cycle's cost is the least of all rounds, and shown is the mean of
all cycles.
"""

import time

import numpy as np

from benchmarks.rows import Row
from benchmarks.step_length import PERIOD_S, wave, waving
from snakewalk.config.loader import load_run
from snakewalk.config.robot import BellyConfig

TITLE = "Bellies: 17 links of alternating16, one step of the body"

SECONDS = 5.0
ROUNDS = 3
STEP_S = 0.002
BELLIES = (
    BellyConfig(shape="ball"),
    BellyConfig(shape="capsule"),
    BellyConfig(shape="rails", width_m=0.1),
)
RUNS = ("flat-slalom", "ramp-10-along", "jacksboro-traverse", "random-10", "steps-4cm", "gaps-8cm")


def run() -> list[Row]:
    """Measure."""
    rows = []
    for name in RUNS:
        first = 0.0
        for belly in BELLIES:
            cost_s = step_s(name, belly)
            first = first or cost_s
            rows.append(Row(f"{name}, {belly.shape}", cost_s * 1e6, "us", "ball", cost_s / first))
    return rows


def step_s(name: str, belly: BellyConfig) -> float:
    """CPU time of a step, s."""
    rounds = []
    for _ in range(ROUNDS):
        body, drive = waving(load_run(name), belly, STEP_S)
        spent = []
        for k in range(1, round(SECONDS / PERIOD_S) + 1):
            drive.goal_rad[:] = wave(k * PERIOD_S, len(drive.goal_rad))
            start = time.process_time()
            body.advance(k * PERIOD_S, drive)
            spent.append(time.process_time() - start)
        rounds.append(spent)
    return float(np.min(rounds, axis=0).mean()) * STEP_S / PERIOD_S
