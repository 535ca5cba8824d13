"""Which motions climb a plane at 80 % of the slope that friction allows a wave, for each law.

The slopes are 80 % of the bounds of ``benchmarks.slope_bound`` for the shipped friction (0.1 along,
0.7 across). Each motion starts at 20 drawn places and headings on the plane. A start counts if the
centre of mass gains 0.6 m along the plane in 20 s without a trip of safety: a third of the speed of
the walk on 15 degrees. Motions without steering run 3 m at most, so nothing corrects their heading.

python -m benchmarks.climbing_motions -o climbing.jsonl
python -m benchmarks.climbing_motions --slope ellipse:30 --motion rolling -o climbing.jsonl

The command continues its file.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

SLOPES: Final = ("ellipse:19", "scales:10", "wheels:20")
"""A law, and 80 % of its bound in degrees."""
SECONDS: Final = 20.0
STARTS: Final = 20
GAINED_M: Final = 0.6
AT_M: Final = 0.05
TURNED_RAD: Final = math.radians(5.0)


@dataclass(frozen=True)
class Motion:
    """A gait of the repertoire, a robot, and the heading of its head; 0 is straight uphill."""

    gait: str
    robot: str
    heading_deg: float = 0.0
    parameters: dict[str, Any] = field(default_factory=dict)


MOTIONS: Final = {
    "wave of 0.7 rad": Motion("lateral-undulation", "yaw16"),
    "wave of 1.0 rad": Motion("lateral-undulation", "yaw16", 0.0, {"winding_rad": 1.0}),
    "wave of 1.3 rad": Motion("lateral-undulation", "yaw16", 0.0, {"winding_rad": 1.3}),
    "wave of 1.3 rad, diagonal": Motion("lateral-undulation", "yaw16", 30.0, {"winding_rad": 1.3}),
    "wave of 1.3 rad, 8 yaw joints": Motion(
        "lateral-undulation", "alternating16", 0.0, {"winding_rad": 1.3}
    ),
    "sidewinding": Motion("sidewinding", "alternating16", 90.0, {"mirror": True}),
    "concertina": Motion("concertina-yaw16", "yaw16"),
    "rectilinear": Motion("rectilinear-narrow", "alternating16"),
    "rolling": Motion("rolling", "alternating16", -90.0),
}


def climbed(name: str, slope: str, seed: int) -> dict[str, Any]:
    """Start a motion on a plane, and return a row of the file."""
    motion = MOTIONS[name]
    law, _, slope_deg = slope.partition(":")
    chance = np.random.default_rng([seed, 18])
    slope_rad = math.radians(float(slope_deg))
    keys = {
        "world.ground.slope_rad": slope_rad,
        "world.ground.length_m": 12.0,
        "world.friction.law": law,
        "run.start_m": tuple(chance.uniform(-AT_M, AT_M, 2).tolist()),
        "run.start_heading_rad": math.radians(motion.heading_deg)
        + chance.uniform(-TURNED_RAD, TURNED_RAD),
    }
    prepared = prepare_gait(
        motion.gait,
        robot=motion.robot,
        world="ramp-15",
        parameters=motion.parameters,
        seconds=SECONDS,
        seed=seed,
        keys=keys,
    )
    with tempfile.TemporaryDirectory() as folder:
        done = run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False))
    centre_m = done.record.pose.centre_m
    centre_m = centre_m[np.isfinite(centre_m).all(axis=1)]
    gained_m = float(centre_m[-1, 0] - centre_m[0, 0]) / math.cos(slope_rad)
    return {
        "motion": name,
        "slope": slope,
        "seed": seed,
        "gained_m": round(gained_m, 3),
        "trip": done.outcome.tripped,
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return a line for each motion, with two columns for each slope."""
    slopes = list(dict.fromkeys(row["slope"] for row in rows))
    lines = [f"| motion | {' | '.join(slopes)} |", "| --- |" + " ---: |" * len(slopes)]
    for name in MOTIONS:
        cells = []
        for slope in slopes:
            of = [row for row in rows if (row["motion"], row["slope"]) == (name, slope)]
            climbs = sum(row["gained_m"] >= GAINED_M and row["trip"] is None for row in of)
            speed = np.median([row["gained_m"] for row in of]) / SECONDS if of else math.nan
            cells.append(f"{climbs} of {len(of)}, {speed:.3f}" if of else "")
        if any(cells):
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Climb what the file lacks, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--slope", action="append", help="LAW:DEGREES")
    parser.add_argument("--motion", action="append", choices=MOTIONS, help="default: all")
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("-o", "--out", type=Path, default=Path("climbing.jsonl"))
    given = parser.parse_args()
    rows = read_lines(given.out, dict, "a row of this benchmark")
    done = {(row["motion"], row["slope"], row["seed"]) for row in rows}
    cases = [
        (name, slope, seed)
        for slope in given.slope or SLOPES
        for name in given.motion or MOTIONS
        for seed in range(given.starts)
    ]
    finished = ((case, climbed(*case)) for case in cases if case not in done)
    rows += [row for _, row in append_lines(given.out, finished, dict)]
    print(table(rows))


if __name__ == "__main__":
    main()
