"""``python -m benchmarks.found_friction``: the friction that walks find on the way.

Each case is a simulated body that differs from its files; its first seconds are walked from several
seeds. What was found from the tenth second on is compared with what was planted.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console

from snakewalk.config.arrays import Floats
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

CASES: dict[str, dict[str, float]] = {
    "as the files": {},
    "along 1.3, across 0.8": {"friction_along": 1.3, "friction_across": 0.8},
    "along 0.7, across 1.2": {"friction_along": 0.7, "friction_across": 1.2},
    "mass 1.2": {"mass": 1.2},
    "torque 0.8": {"torque": 0.8},
}
SETTLED_S = 10.0


@dataclass(frozen=True, slots=True)
class Found:
    """One walk's rows of ``/friction``: factors on the file's friction."""

    off: Floats
    """(F, 2) logarithms along and across, found less planted."""
    inside: Floats
    """(F, 2) 1 where the interval holds what was planted."""
    out_s: float
    """Time of the first event about friction; NaN: none."""


def walk(run: str, case: dict[str, float], seed: int, seconds: float, pose: str | None) -> Found:
    """Walk, and compare."""
    keys = {f"run.deviation.{name}": value for name, value in case.items()}
    told: dict[str, object] = {"run.time_limit_s": seconds}
    if pose is not None:
        told["run.pose"] = pose
    with TemporaryDirectory() as folder:
        prepared = prepare_job(run, keys={**keys, **told}, seed=seed)
        record = run_robot(RunRequest(prepared, Path(folder), stoppable=False)).record
    table, file = record.friction, record.header.world.friction
    there = np.array(
        [
            file.along * case.get("friction_along", 1.0),
            file.across * case.get("friction_across", 1.0),
        ]
    )
    kept = table.time_s > SETTLED_S
    intervals = np.stack([table.along_95, table.across_95], axis=1)[kept]
    inside = (intervals[:, :, 0] < there) & (there < intervals[:, :, 1])
    off = np.log(np.column_stack([table.along, table.across])[kept] / there)
    said = [event.time_s for event in record.events if event.kind == "friction"]
    return Found(off, inside.astype(float), said[0] if said else float("nan"))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.found_friction")
    parser.add_argument("--run", action="append", default=[])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--pose", help="camera: on a level floor the balance is the model")
    given = parser.parse_args()
    console, seeds = Console(width=200), range(given.first_seed, given.first_seed + given.seeds)
    for run in given.run or ["flat-slalom", "jacksboro-traverse", "jacksboro-steep"]:
        for name, case in CASES.items():
            found = [walk(run, case, seed, given.seconds, given.pose) for seed in seeds]
            off = np.concatenate([each.off for each in found])
            inside = np.concatenate([each.inside for each in found]).mean(axis=0)
            rms = np.sqrt((off**2).mean(axis=0))
            ratio = np.sqrt(((off[:, 1] - off[:, 0]) ** 2).mean())
            out = ", ".join("-" if np.isnan(each.out_s) else f"{each.out_s:.0f}" for each in found)
            console.print(
                f"| `{run}` | {name} | {100 * rms[0]:.0f} % | {100 * rms[1]:.0f} % | "
                f"{100 * ratio:.0f} % | {100 * inside[0]:.0f} % | {100 * inside[1]:.0f} % | "
                f"{out} |"
            )


if __name__ == "__main__":
    main()
