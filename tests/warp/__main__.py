"""``python -m tests.warp``: compare MuJoCo-Warp with the compiled simulator, gait by gait.

It needs the extra ``warp``; ``make warp`` runs it. Every gait that fits a robot runs for 4 s on a
level floor, through the same motion, safety and servos. The deviation is the mean distance between
the links of both simulators at 4 s, as a share of the mean distance that they have come.
"""

import argparse
import json
import sys
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import warp
from snakewalk.config.friction_law import LAWS
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.sim.batch.warp_bodies import WarpBodies
from tests.helpers.gait_links import SECONDS, links_of, prepared_gaits
from tests.oracles.compiled_bodies import CompiledBodies

MOST = 0.005
"""Largest deviation."""
IMPRECISE = {"carangiform", "thunniform"}
"""Swimming gaits that creep a few millimetres per second on a floor: single precision changes them
(``python -m benchmarks.rounded_bodies``)."""


def main() -> int:
    """Print the table; 1 if a deviation is too large."""
    parser = argparse.ArgumentParser(prog="python -m tests.warp", description=__doc__)
    parser.add_argument("--robot", nargs="+", default=["yaw16", "alternating16"])
    parser.add_argument("--gait", nargs="+", default=list(GAITS))
    parser.add_argument("--law", choices=LAWS, help="law of friction; default: the worlds'")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--copies", type=int, default=1, help="how often each gait is in the batch")
    given = parser.parse_args()
    kernels_s, rows, rates = [], [], {}
    for robot in given.robot:
        prepared = prepared_gaits(robot, given.gait, given.law)
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


def _compare(
    prepared: list[GaitRun], device: str, copies: int
) -> tuple[list[tuple[float, float]], float, float]:
    begin_s = time.perf_counter()
    first_s: list[float] = []

    def note(time_s: float) -> None:
        if not first_s:
            first_s.append(time.perf_counter() - begin_s)

    with TemporaryDirectory() as folder:
        ours = links_of(prepared, CompiledBodies, Path(folder) / "compiled")
        begin_s = time.perf_counter()
        theirs = links_of(
            prepared * copies, partial(WarpBodies, device=device), Path(folder) / "warp", note
        )
    warp_s = time.perf_counter() - begin_s - first_s[0]
    found = []
    for a, b in zip(ours, theirs, strict=False):
        way_m = float(np.linalg.norm(a[-1] - a[0], axis=1).mean())
        off_m = float(np.linalg.norm(b[-1] - a[-1], axis=1).mean())
        found.append((off_m / way_m, way_m))
    return found, warp_s, first_s[0]


if __name__ == "__main__":
    sys.exit(main())
