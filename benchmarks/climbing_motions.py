"""Which motions climb a plane at 80 % of the slope that friction allows a wave, for each law.

The slopes are 80 % of the bounds of ``benchmarks.slope_bound`` for the shipped friction (0.1 along,
0.7 across). Each motion starts at 20 drawn places and headings. A gait starts on the plane, and a
start counts if the centre of mass gains 0.6 m along the plane in 20 s without a trip of safety: a
third of the speed of the walk on 15 degrees. Motions without steering run 3 m at most, so nothing
corrects their heading. A walk starts on level floor before 4 m of plane, and a start counts if it
reaches both waypoints in 240 s. It has no second body, as on a port.

python -m benchmarks.climbing_motions -o climbing.jsonl
python -m benchmarks.climbing_motions --slope ellipse:30 --motion rolling -o climbing.jsonl
python -m benchmarks.climbing_motions --slope crop:21003 --starts 5 -o climbing.jsonl

A crop is a ground of ``benchmarks.drawn_walks`` with its seed, on which only walks are tried. The
command continues its file.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.steep_rehearsals import Ground, crop, ramp
from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines
from snakewalk.controller.run.factory import prepare_walk
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
CROP: Final = "crop"
PERMITTED: Final = {
    "world.planner.slope_limit_rad": 1.4,
    "world.planner.variance_limit_m2": 1.0,
    "world.planner.climb_limit_rad": 0.8,
}
"""Limits of the planner that permit a path up the plane."""


@dataclass(frozen=True)
class Motion:
    """A gait of the repertoire, a robot, and the heading of its head; 0 is straight uphill."""

    gait: str
    robot: str
    heading_deg: float = 0.0
    parameters: dict[str, Any] = field(default_factory=dict)


WALKS: Final[dict[str, dict[str, Any]]] = {
    "walk": {},
    "walk, stiff pitch joints": {
        "run.walk.pitch.p_gain": 800,
        "run.walk.pitch.current_limit_a": 0.4,
    },
    "walk of yaw16": {"run.robot": "yaw16"},
}
"""Keys of walks by their names."""
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
    """Start a motion, and return a row of the file."""
    row = _walked(name, slope, seed) if name in WALKS else _gained(name, slope, seed)
    return {"motion": name, "slope": slope, "seed": seed, **row}


def _walked(name: str, slope: str, seed: int) -> dict[str, Any]:
    law, _, number = slope.partition(":")
    chance = np.random.default_rng([seed, 18])
    ground = crop(int(number)) if law == CROP else _plane(law, float(number))
    plain = prepare_walk(ground.run, keys=ground.keys, **ground.changes)
    start_m, towards_m = np.array([plain.run.start_m, plain.run.waypoints_m[0]])
    begin_m = start_m + chance.uniform(-AT_M, AT_M, 2)
    keys = ground.keys | WALKS[name] | {"run.walk.tries": 0}
    walk = prepare_walk(
        ground.run,
        keys=keys,
        seed=seed,
        robot=keys.pop("run.robot", None),
        **{
            **ground.changes,
            "start_m": tuple(begin_m.tolist()),
            "start_heading_rad": float(np.arctan2(*(towards_m - start_m)[::-1]))
            + chance.uniform(-TURNED_RAD, TURNED_RAD),
        },
    )
    with tempfile.TemporaryDirectory() as folder:
        done = run_robot(RunRequest(walk, Path(folder) / "run", stoppable=False))
    return {
        "reached": done.outcome.reached,
        "waypoints": len(walk.run.waypoints_m),
        "missed": done.outcome.missed,
        "duration_s": round(done.outcome.duration_s, 1),
        "cause": done.verdict.cause,
        "trip": done.outcome.tripped,
    }


def _plane(law: str, slope_deg: float) -> Ground:
    plane = ramp(slope_deg)
    return replace(plane, keys=plane.keys | PERMITTED | {"world.friction.law": law})


def _gained(name: str, slope: str, seed: int) -> dict[str, Any]:
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
    return {"gained_m": round(gained_m, 3), "trip": done.outcome.tripped}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return a line for each motion, with a column for each slope."""
    slopes = list(dict.fromkeys(row["slope"] for row in rows))
    lines = [f"| motion | {' | '.join(slopes)} |", "| --- |" + " ---: |" * len(slopes)]
    for name in (*MOTIONS, *WALKS):
        cells = [
            _cell([row for row in rows if (row["motion"], row["slope"]) == (name, slope)])
            for slope in slopes
        ]
        if any(cells):
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(rows: Sequence[dict[str, Any]]) -> str:
    """Successful starts, and the median speed of a gait or duration of a walk."""
    if not rows:
        return ""
    if "gained_m" in rows[0]:
        climbs = sum(row["gained_m"] >= GAINED_M and row["trip"] is None for row in rows)
        return (
            f"{climbs} of {len(rows)}, {np.median([row['gained_m'] for row in rows]) / SECONDS:.3f}"
        )
    arrived = [row for row in rows if row["reached"] == row["waypoints"]]
    cell = f"{len(arrived)} of {len(rows)}"
    if arrived:
        cell += f", {np.median([row['duration_s'] for row in arrived]):.0f} s"
    return cell


def main() -> None:
    """Climb what the file lacks, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--slope", action="append", help="LAW:DEGREES, or crop:SEED")
    names = (*MOTIONS, *WALKS)
    parser.add_argument("--motion", action="append", choices=names, help="default: all")
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("-o", "--out", type=Path, default=Path("climbing.jsonl"))
    given = parser.parse_args()
    rows = read_lines(given.out, dict, "a row of this benchmark")
    done = {(row["motion"], row["slope"], row["seed"]) for row in rows}
    cases = [
        (name, slope, seed)
        for slope in given.slope or SLOPES
        for name in given.motion or names
        for seed in range(given.first_seed, given.first_seed + given.starts)
        if name in WALKS or not slope.startswith(CROP)
    ]
    finished = ((case, climbed(*case)) for case in cases if case not in done)
    rows += [row for _, row in append_lines(given.out, finished, dict)]
    print(table(rows))


if __name__ == "__main__":
    main()
