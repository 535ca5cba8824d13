"""``python -m tests.warp``: compare MuJoCo-Warp with the compiled simulator, gait by gait.

It needs the extra ``warp``; ``make warp`` runs it. Every gait that fits a robot runs for 4 s on a
level floor, through the same motion, safety and servos. The deviation is the mean distance between
the links of both simulators at 4 s, as a share of the mean distance that they have come.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import warp
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_world
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.run.external.gait_batch import MakeBodies, run_together
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.runlog.reader import read_log
from snakewalk.sim.batch.warp_bodies import WarpBodies
from tests.oracles.compiled_bodies import CompiledBodies

SECONDS = 4.0
MOST = 0.005
"""Largest deviation."""
IMPRECISE = {"carangiform", "thunniform"}
"""Swimming gaits that creep a few millimetres per second on a floor: single precision changes them
(docs/benchmarks/warp.md)."""


def main() -> int:
    """Print the table; 1 if a deviation is too large."""
    parser = argparse.ArgumentParser(prog="python -m tests.warp", description=__doc__)
    parser.add_argument("--robot", nargs="+", default=["yaw16", "alternating16"])
    parser.add_argument("--gait", nargs="+", default=list(GAITS))
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--copies", type=int, default=1, help="how often each gait is in the batch")
    given = parser.parse_args()
    kernels_s, rows, rates = [], [], {}
    for robot in given.robot:
        prepared = _prepared(robot, given.gait)
        if not prepared:
            continue
        found, warp_s, compile_s = _compare(prepared, given.device, given.copies)
        kernels_s.append(compile_s)
        steps = SECONDS / 0.002 * len(prepared) * given.copies
        rates[robot] = round(steps / warp_s)
        for run, (deviation, way_m) in zip(prepared, found, strict=True):
            row = {"robot": robot, "gait": run.run.name, "world": run.world.name}
            rows.append(row | {"deviation": deviation, "way_m": way_m})
            print(
                f"{robot:15} {run.run.name:22} {run.world.name:10} {way_m:7.3f} m {deviation:9.5%}"
            )
    compiled = ", ".join(f"{seconds:.0f}" for seconds in kernels_s)
    print(f"time until the first step, compilation of the kernels included: {compiled} s")
    device = warp.get_device(given.device)
    if device.is_cuda:
        print(f"steps per second on {device.name}, motions and logs included: {json.dumps(rates)}")
    else:
        print("no GPU was used: steps per second were not measured")
    exact = [row["deviation"] for row in rows if row["gait"] not in IMPRECISE]
    worst = max(exact, default=0.0)
    print(
        f"largest deviation: {worst:.5%}, limit {MOST:.1%}; without {', '.join(sorted(IMPRECISE))}"
    )
    return int(not worst <= MOST)


def _prepared(robot: str, gaits: Sequence[str]) -> list[GaitRun]:
    found = []
    for name in gaits:
        world = load_world(GAITS[name].world)
        flat = world.ground.kind == "flat" and world.obstacle is None
        where = world.name if flat else "isotropic"
        try:
            run = prepare_gait(name, robot=robot, world=where, seconds=SECONDS + 1.0)
            run.check_plan()
        except InputError as error:
            print(f"{robot:15} {name:22} left out: {error.faults[0]}")
            continue
        found.append(run)
    return found


def _compare(
    prepared: list[GaitRun], device: str, copies: int
) -> tuple[list[tuple[float, float]], float, float]:
    begin_s = time.perf_counter()
    first_s: list[float] = []

    def note(time_s: float) -> None:
        if not first_s:
            first_s.append(time.perf_counter() - begin_s)

    with TemporaryDirectory() as folder:
        ours = _links(prepared, CompiledBodies, Path(folder) / "compiled")
        begin_s = time.perf_counter()
        theirs = _links(
            prepared * copies, partial(WarpBodies, device=device), Path(folder) / "warp", note
        )
    warp_s = time.perf_counter() - begin_s - first_s[0]
    found = []
    for a, b in zip(ours, theirs, strict=False):
        way_m = float(np.linalg.norm(a[-1] - a[0], axis=1).mean())
        off_m = float(np.linalg.norm(b[-1] - a[-1], axis=1).mean())
        found.append((off_m / way_m, way_m))
    return found, warp_s, first_s[0]


def _links(
    prepared: list[GaitRun],
    make_bodies: MakeBodies,
    folder: Path,
    note: object = lambda time_s: None,
) -> list[Floats]:
    """Places of the links at the begin and at ``SECONDS``, (2, L, 3) of each run."""
    logs = [folder / f"{number}.mcap" for number in range(len(prepared))]
    run_together(prepared, logs, make_bodies, note)  # type: ignore[arg-type]
    found = []
    for log in logs:
        pose = read_log(log).pose
        at = int(np.searchsorted(pose.time_s, SECONDS - 1e-9))
        found.append(pose.links_m[[0, at]])
    return found


if __name__ == "__main__":
    sys.exit(main())
