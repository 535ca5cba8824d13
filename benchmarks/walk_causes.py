"""``python -m benchmarks.walk_causes``: causes planted in walks, and the causes that are named.

A seed draws a kind of walk that fails for one reason, and how strongly. The verdict of the run is
right if it names that reason. A walk that arrives in spite of it counts as arrived, not as named.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from benchmarks.hard_walks import fault_of, kept_rows, on_its_back, planted
from snakewalk.config.arrays import Floats
from snakewalk.config.faults import FaultPlan
from snakewalk.controller.kinematics.rotations import offset_rad
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.walk import pilot
from snakewalk.drivers.errors import DriverError, notes_of

KINDS: Final[dict[str, tuple[str, ...]]] = {
    "time limit": ("time",),
    "steep ahead": ("climb", "roll"),
    "steep across": ("slip", "roll"),
    "ice": ("slip",),
    "weak servos": ("joint", "safety"),
    "on its back": ("roll",),
    "wrong heading": ("steering",),
    "faulty servo": ("safety",),
}
"""What is planted, and the causes that are right: a body may roll on a steep slope as well."""
SECONDS: Final = 45.0
STEEP: Final = {
    "world.planner.variance_limit_m2": 1.0,
    "world.planner.slope_limit_rad": 0.8,
    "world.planner.climb_limit_rad": 0.8,
}
"""Limits of a planner that takes any slope."""


def drawn(seed: int) -> tuple[str, WalkRun, np.random.Generator]:
    """Return the kind of a walk, the walk, and what draws the rest; kinds come in turn."""
    chance = np.random.default_rng([seed, 68])
    kind = list(KINDS)[seed % len(KINDS)]
    run = str(chance.choice(["flat-slalom", "random-10", "jacksboro-traverse"]))
    keys: dict[str, Any] = {"run.time_limit_s": SECONDS, "run.walk.tries": 0, "run.seed": seed}
    match kind:
        case "time limit":
            keys["run.time_limit_s"] = chance.uniform(8.0, 16.0)
        case "steep ahead":
            run, slope_deg = "ramp-15-up", chance.uniform(24.0, 32.0)
            keys |= STEEP | {"world.ground.slope_rad": np.radians(slope_deg)}
        case "steep across":
            run, slope_deg = "ramp-10-along", chance.uniform(18.0, 26.0)
            keys |= STEEP | {"world.ground.slope_rad": np.radians(slope_deg)}
            keys["run.deviation.friction_across"] = chance.uniform(0.4, 0.8)
        case "ice":
            run = str(chance.choice(["flat-slalom", "random-10"]))
            keys["run.deviation.friction_across"] = chance.uniform(0.05, 0.2)
        case "weak servos":
            keys["run.deviation.torque"] = chance.uniform(0.03, 0.12)
        case _:
            pass
    return kind, prepare_walk(run, keys=keys), chance


@contextmanager
def turned(angle_rad: float) -> Iterator[None]:
    """Let walks take their heading ``angle_rad`` wrong, and so steer wrong."""

    def wrong_rad(headings_rad: Floats, believed_rad: Floats) -> float:
        return offset_rad(headings_rad, believed_rad) + angle_rad

    with patch.object(pilot, "offset_rad", wrong_rad):
        yield


def walked(seed: int) -> dict[str, Any]:
    """Walk; return what happened, ready for JSON."""
    kind, walk, chance = drawn(seed)
    row: dict[str, Any] = {"seed": seed, "kind": kind, "run": walk.run.name}
    plan = FaultPlan()
    if kind == "faulty servo":
        row["fault"], *_, plan = fault_of(seed, walk.robot.joint_count)
    roll_rad = float(chance.uniform(2.0, 4.3)) if kind == "on its back" else 0.0
    off_rad = float(chance.choice([-1.0, 1.0]) * chance.uniform(1.2, 2.2))
    try:
        with on_its_back(roll_rad), planted(plan), ExitStack() as more:
            if kind == "wrong heading":
                more.enter_context(turned(off_rad))
            end = run_robot(RunRequest(walk, stoppable=False)).verdict
    except DriverError as error:  # a servo that is silent at the end
        text = " ".join([str(error), *notes_of(error)])
        named = "safety" if "tripped by" in text else None
        return row | {"named": named, "text": text, "code": 1}
    return row | {"named": end.failure, "text": end.with_cause, "code": end.exit_code}


def table(rows: list[dict[str, Any]]) -> str:
    """Return a line for each kind."""
    lines = ["| planted | right cause | walks | arrived | right | named instead |"]
    lines.append("| --- | --- | ---: | ---: | ---: | --- |")
    for kind, causes in KINDS.items():
        of = [row for row in rows if row["kind"] == kind]
        failed = [row for row in of if row["code"]]
        right = sum(row["named"] in causes for row in failed)
        others = Counter(row["named"] for row in failed if row["named"] not in causes)
        instead = ", ".join(f"{name} {count}" for name, count in others.items()) or "-"
        arrived = len(of) - len(failed)
        lines.append(
            f"| {kind} | {' or '.join(causes)} | {len(of)} | {arrived} | {right} | {instead} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Walk what the file lacks, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.walk_causes", description=__doc__)
    parser.add_argument("--walks", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("causes.jsonl"))
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.walks)
    print(table(kept_rows(walked, seeds, given.out, given.workers)))


if __name__ == "__main__":
    main()
