"""``python -m benchmarks.righting RUN``: bodies put on their backs, which walk and turn home.

The run's walk begins on its back, its start moved by 0.04 m (normal) with the seed. Nothing but the
IMU tells it how it lies. It is righted if the simulator has the head within 75 degrees of upright
throughout the last two seconds; it says so if its log tells that it had rolled over.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from snakewalk.controller.metrics.ground_contact import roll_rad
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.trials import Case, prepare_case
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import MujocoPlant

SPREAD_M, LAST_S, UPRIGHT_RAD = 0.04, 2.0, np.deg2rad(75.0)
_RESET, _HEAD_POSE = MujocoPlant.reset, MujocoPlant.head_pose


def main() -> None:
    """Print one row a run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--robot", default="alternating16-imu")
    parser.add_argument("--pose", default="imu")
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    asked = parser.parse_args()
    table = Table("run", "righted", "said so", "first upright s", "stopped", box=None)
    for name in asked.runs:
        case = Case(name, "walk", asked.robot, keys=(("run.pose", asked.pose),))
        tried = []
        for seed in range(asked.first_seed, asked.first_seed + asked.seeds):
            tried.append(fallen(case, seed, asked.seconds))
            print(name, seed, *tried[-1], file=sys.stderr, flush=True)
        righted = [after_s for after_s, _, _ in tried if np.isfinite(after_s)]
        median = f"{np.median(righted):.1f}" if righted else "-"
        said, tripped = (sum(each[k] for each in tried) for k in (1, 2))
        count = f"{len(righted)} of {len(tried)}"
        table.add_row(name, count, str(said), median, str(tripped))
    Console().print(table)


def fallen(case: Case, seed: int, seconds: float) -> tuple[float, bool, bool]:
    """Walk from the back: when it was upright for good, s, whether it told, whether it tripped."""
    rolls: list[tuple[float, float]] = []

    def on_its_back(plant: MujocoPlant, *place: Any) -> None:
        _RESET(plant, *place)
        data, half_turn = plant.mechanics.data, np.array([0.0, 1.0, 0.0, 0.0])
        mujoco.mju_mulQuat(data.qpos[3:7], data.qpos[3:7].copy(), half_turn)
        mujoco.mj_forward(plant.mechanics.model, data)

    def watched(plant: MujocoPlant) -> BodyPose:
        pose = _HEAD_POSE(plant)
        rolls.append((pose.time_s, abs(float(roll_rad(pose.rotation[None])[0]))))
        return pose

    prepared = prepare_case(case, seed, SPREAD_M, {"time_limit_s": seconds})
    with (
        TemporaryDirectory() as folder,
        patch.object(MujocoPlant, "reset", on_its_back),
        patch.object(MujocoPlant, "head_pose", watched),
    ):
        done = run_robot(RunRequest(prepared, Path(folder), stoppable=False))
    time_s, roll = np.array(rolls).T
    over = np.flatnonzero(roll > UPRIGHT_RAD)
    last_s = time_s[over[-1]] if len(over) else 0.0
    righted = time_s[-1] - last_s >= LAST_S and done.outcome.tripped is None
    told = any(e.kind == "roll" and e.text.startswith("rolled") for e in done.record.events)
    return float(last_s) if righted else float("nan"), told, done.outcome.tripped is not None


if __name__ == "__main__":
    main()
