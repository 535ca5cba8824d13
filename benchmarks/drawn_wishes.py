"""Drawn speeds and turns for ``gait repertoire play``: met in the mean of ten cycles, or rejected.

``python -m benchmarks.drawn_wishes FILE.npz [--wishes 20] [--seed 0]``: each wish runs on the
simulated robot of the recording. The mean of the measured speeds and turns is weighted by the time
of each action; the first action begins at rest and is left out.
"""

import argparse
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.controller.repertoire.mixture import CYCLES
from snakewalk.controller.repertoire.prepare_schedule import prepare_schedule
from snakewalk.controller.repertoire.schedule_run import ScheduleMotion
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

SPEED_M_S, TURN_RAD_S = (-0.6, 0.8), (-1.2, 1.2)
"""Ranges of the wishes: wider than the recorded actions."""
CYCLE_S = 3.4
"""No recorded cycle of the shipped robots is longer."""


def rates(file: Path, speed_m_s: float, turn_rad_s: float) -> tuple[Floats, Floats]:
    """Recorded and measured mean speed and turn (2,) over ten cycles.

    Raises:
        InputError: no actions have this mean.

    """
    asked = ScheduleConfig(
        speed_m_s=speed_m_s, turn_rad_s=turn_rad_s, duration_s=CYCLE_S * (CYCLES + 2)
    )
    result = run_robot(RunRequest(prepare_schedule(file, asked)))
    assert isinstance(result.source, ScheduleMotion), "a schedule's run has no other motion"
    played = result.source.played
    begin_s = np.array([action.begin_s for action in played])
    cycles = slice(1, 1 + CYCLES)
    weight = np.diff(begin_s)[cycles]
    recorded, measured = (
        np.average([getattr(action, key) for action in played[cycles]], axis=0, weights=weight)
        for key in ("recorded", "measured")
    )
    return recorded, measured


def main() -> None:
    """Print a row for each wish."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--wishes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    random = np.random.default_rng(given.seed)
    print("| wish | recorded | measured |\n| --- | --- | --- |")
    for _ in range(given.wishes):
        wish = np.round([random.uniform(*SPEED_M_S), random.uniform(*TURN_RAD_S)], 2).tolist()
        try:
            means = rates(given.file, *wish)
        except InputError as fault:
            cells = [str(fault), ""]
        else:
            cells = [f"{mean[0]:.3f} m/s, {mean[1]:.3f} rad/s" for mean in means]
        print(f"| {wish[0]:.2f} m/s, {wish[1]:.2f} rad/s | {cells[0]} | {cells[1]} |", flush=True)


if __name__ == "__main__":
    main()
