"""Crossing ground that is not known: by a stereo head's map, beside the same runs on the true map.

python -m benchmarks.unknown_ground --first-seed 2000   # some minutes a world; as Markdown
python -m benchmarks.unknown_ground --mast              # pictures from masts of several heights
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.camera import MappingConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.world import WorldConfig
from snakewalk.controller.mapping.stereo_head import StereoHead
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.sim.physics.plant import MujocoPlant

WORLDS = ("jacksboro-gentle", "random-10", "jacksboro-basin")
ROBOT = "alternating16-stereo"
LEAST_M, MOST_M, BORDER_M, LIMIT_S = 2.4, 3.0, 1.6, 45.0
BESIDE_M = 0.6
MASTS = ((0.03, 0.2), (0.10, 0.3), (0.25, 0.5), (0.40, 0.6))
"""Heights (m) and tilts (rad) that are compared."""


@dataclass(frozen=True)
class Crossing:
    """One run from a place by chance to another."""

    reached: bool
    duration_s: float
    way_m: float
    """Of the body's centre."""
    unsafe_m: float
    """Way of the head over ground that the true map calls unsafe."""
    replans: int
    error_m: Floats
    """(k,) of the map's heights; empty on the true map."""
    covered: float
    """Share in the map of the ground within ``BESIDE_M`` of the centre's way."""
    unknown_m: float
    """Way of the head over what was not in the map yet."""


def places(world: WorldConfig, planner: TerrainPlanner, seed: int) -> tuple[Floats, Floats]:
    """Start and goal (2,) by chance, safe, and joined by a path on the true map not much longer."""
    assert planner.relief is not None
    size, rng = planner.relief.ground.size_m, np.random.default_rng(seed)
    while True:
        ends = rng.uniform(-0.5, 0.5, (2, 2)) * (np.array(size) - 2.0 * BORDER_M)
        apart_m = float(np.hypot(*(ends[1] - ends[0])))
        if not LEAST_M <= apart_m <= MOST_M or not planner.relief.safe(*ends.T).all():
            continue
        try:
            if planner.plan(ends).length_m <= 1.4 * apart_m:
                return ends[0], ends[1]
        except InputError:
            continue


def cross(world_name: str, seed: int, stereo: bool) -> Crossing:
    """Walk from place to place, on the true map or by the stereo head."""
    robot, world = load_robot(ROBOT), load_world(world_name)
    known = WalkRun(load_run("random-10"), robot, world)
    start, goal = places(world, known.planner, seed)
    run = known.run.model_copy(
        update={
            "start_m": tuple(start.tolist()),
            "waypoints_m": (tuple(goal.tolist()),),
            "start_heading_rad": float(np.arctan2(*(goal - start)[::-1])),
            "time_limit_s": LIMIT_S,
            "seed": seed,
            "mapping": MappingConfig() if stereo else None,
        }
    )
    prepared = replace(known, run=run)
    with tempfile.TemporaryDirectory() as folder:
        return judged(run_robot(RunRequest(prepared, Path(folder), stoppable=False)), known.planner)


def judged(finished: RunResult, planner: TerrainPlanner) -> Crossing:
    """What became of a run."""
    assert planner.relief is not None
    pose, found = finished.record.pose, finished.map
    steps = np.hypot(*np.diff(pose.head_m[:, :2], axis=0).T)
    unsafe = ~planner.relief.safe(*pose.head_m[1:, :2].T)
    error_m, covered = np.empty(0), float("nan")
    if found.ground_map is not None:
        error_m = found.ground_map.errors_m(planner.relief.ground)
        covered = coverage(found.ground_map, pose.centre_m[::10, :2])
    return Crossing(
        finished.outcome.complete,
        finished.outcome.duration_s,
        float(np.hypot(*np.diff(pose.centre_m[:, :2], axis=0).T).sum()),
        float(steps[unsafe].sum()),
        max(len(finished.record.paths) - 1, 0),
        error_m,
        covered,
        found.head_over_unknown_m,
    )


def coverage(ground_map: GrowingMap, way_m: Floats) -> float:
    """Share of the samples within ``BESIDE_M`` of a way (n, 2) that were seen."""
    rows, columns = ground_map.z_m.shape
    x = ground_map.x0_m + ground_map.spacing_m * np.arange(columns)
    y = ground_map.y0_m + ground_map.spacing_m * np.arange(rows)
    away = [np.hypot(x[None] - px, y[:, None] - py) for px, py in way_m]
    near = np.min(away, axis=0) <= BESIDE_M
    return float(ground_map.known[near].mean())


def crossings_table(seeds: range, worlds: tuple[str, ...]) -> None:
    """Success, time and way on the true map and on the head's; its errors and coverage."""
    print(
        "| world | map | reached | time | way | unsafe | replans | RMS | median | 95 % | ", end=""
    )
    print("covered | unknown |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for world in worlds:
        both = {how: [cross(world, seed, how) for seed in seeds] for how in (False, True)}
        print("\n".join(crossing_rows(world, both[False], both[True])), flush=True)


def crossing_rows(world: str, known: list[Crossing], seen: list[Crossing]) -> list[str]:
    """Two lines of the table; times and ways are means over seeds on which both arrived."""
    arrived = [one.reached and other.reached for one, other in zip(known, seen, strict=True)]
    lines = []
    for how, runs in (("world", known), ("stereo", seen)):
        same = [run for run, each in zip(runs, arrived, strict=True) if each]
        cells = [
            f"`{world}`",
            how,
            f"{sum(run.reached for run in runs)} of {len(runs)}",
            f"{np.mean([run.duration_s for run in same]):.1f} s" if same else "",
            f"{np.mean([run.way_m for run in same]):.2f} m" if same else "",
            f"{np.mean([run.unsafe_m for run in runs]):.2f} m",
            f"{np.mean([run.replans for run in runs]):.1f}",
        ]
        if how == "stereo":
            error = np.abs(np.concatenate([run.error_m for run in runs]))
            numbers = np.sqrt((error**2).mean()), np.median(error), np.quantile(error, 0.95)
            cells += [f"{1000 * number:.1f} mm" for number in numbers]
            cells.append(f"{100 * np.mean([run.covered for run in runs]):.0f} %")
            cells.append(f"{np.mean([run.unknown_m for run in runs]):.2f} m")
        else:
            cells += [""] * 5
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def mast_table(seeds: range) -> None:
    """What one look shows from masts of several heights, on bodies that lie by chance."""
    print("| mast | tilt | looks | within 1 m | within 2 m | RMS | median | 95 % |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    world, robot = load_world(WORLDS[0]), load_robot(ROBOT)
    run = load_run("random-10").model_copy(update={"mapping": MappingConfig()})
    planner = WalkRun(run.model_copy(update={"mapping": None}), robot, world).planner
    assert planner.relief is not None
    ground, head = planner.relief.ground, robot.stereo_head
    assert head is not None
    for height_m, tilt_rad in MASTS:
        mast = head.model_copy(update={"height_m": height_m, "tilt_rad": tilt_rad})
        body = robot.model_copy(update={"stereo_head": mast})
        plant = MujocoPlant(body, world, ground, 0.001)
        error_m, areas_m2 = [], []
        for seed in seeds:
            start, goal = places(world, planner, seed)
            joints = np.random.default_rng(seed).uniform(-0.3, 0.3, robot.joint_count)
            joints[list(robot.pitch_joints)] = 0.0
            heading = float(np.arctan2(*(goal - start)[::-1]))
            plant.reset((float(start[0]), float(start[1])), heading, joints)
            seen = GrowingMap.over(ground, 0.04)
            taken = run.model_copy(update={"seed": seed})
            qpos = plant.qpos
            view = StereoHead(taken, body, world, ground, partial(np.copy, qpos), seen)
            view.observe(0.0, plant.head_pose(), qpos[7:])
            view.fuse(np.inf)
            view.close()
            error_m.append(seen.errors_m(ground))
            row, column = np.nonzero(seen.known)
            x, y = seen.x0_m + 0.04 * column, seen.y0_m + 0.04 * row
            away = np.hypot(x - start[0], y - start[1])
            areas_m2.append([0.04**2 * (away <= reach).sum() for reach in (1.0, 2.0)])
        error, area = np.abs(np.concatenate(error_m)), np.mean(areas_m2, axis=0)
        numbers = np.sqrt((error**2).mean()), np.median(error), np.quantile(error, 0.95)
        cells = " | ".join(f"{1000 * number:.1f} mm" for number in numbers)
        print(
            f"| {100 * height_m:.0f} cm | {tilt_rad:.1f} rad | {len(seeds)} | {area[0]:.2f} m2 | "
            f"{area[1]:.2f} m2 | {cells} |",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--world", choices=WORLDS)
    parser.add_argument("--mast", action="store_true")
    asked = parser.parse_args()
    span = range(asked.first_seed, asked.first_seed + asked.seeds)
    if asked.mast:
        mast_table(span)
    else:
        crossings_table(span, WORLDS if asked.world is None else (asked.world,))
