"""How varied the motion of a walk is on slopes: effective frequencies of the joint goals.

The spectrum of each yaw joint's goals is averaged over windows of 20 s that overlap by half (Welch
1967, Hann window). Its effective number of frequencies is the exponential of the entropy of the
power between 0.05 and 4 Hz, in bins of 0.05 Hz; the mean over the joints is printed. A serpenoid
has one frequency, which the window spreads over 2.4 bins.

python -m benchmarks.variety --slopes 0.2 12 --seeds 4 --first-seed 10 -o variety.jsonl
python -m benchmarks.variety --slopes 12 --set run.walk.climb_progress=0 --seeds 4 -o variety.jsonl

The command continues its file.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.signal

from snakewalk.config.arrays import Floats
from snakewalk.controller.console.options import key_values
from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

RUN = "ramp-10-up"
WINDOW_S = 20.0
BAND_HZ = (0.05, 4.0)
STILL_RAD = 0.05
"""Standard deviation under which a joint does not take part."""


def effective_frequencies(goals_rad: Floats, period_s: float) -> float:
    """Effective number of frequencies of goals (n, joints), mean over the joints that move."""
    moving = goals_rad[:, goals_rad.std(axis=0) > STILL_RAD]
    frequency_hz, power = scipy.signal.welch(
        moving, 1.0 / period_s, "hann", round(WINDOW_S / period_s), axis=0
    )
    least_hz, most_hz = BAND_HZ
    inside = (frequency_hz > least_hz - 1e-9) & (frequency_hz < most_hz)
    share = power[inside] / power[inside].sum(axis=0)
    entropy = -(share * np.log(share + 1e-300)).sum(axis=0)
    return float(np.exp(entropy).mean())


def measured(slope_deg: float, motion: str, seed: int, changes: Sequence[str]) -> dict[str, Any]:
    """Walk up a plane with other values of keys, and return a row of the file."""
    keys = {"world.ground.slope_rad": math.radians(slope_deg)}
    keys |= key_values("--set", list(changes))
    prepared = prepare_walk(RUN, seed=seed, motion=motion, keys=keys)
    with tempfile.TemporaryDirectory() as folder:
        finished = run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False))
    cycle, summary = finished.record.cycle, finished.summary
    goals_rad = cycle.sent_rad[np.isfinite(cycle.sent_rad).all(axis=1)]
    return {
        "slope_deg": slope_deg,
        "motion": motion,
        "seed": seed,
        "changes": " ".join(changes),
        "has_arrived": summary.waypoints_reached == summary.waypoints,
        "duration_s": summary.duration_s,
        "frequencies": effective_frequencies(goals_rad, finished.record.period_s),
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the rows as a table, one line for a slope, a motion and other values of keys."""
    lines = [
        "| slope, degrees | motion | runs | arrived | duration, s | effective frequencies |",
        "| ---: | --- | ---: | ---: | ---: | ---: |",
    ]
    for case in sorted({_case(row) for row in rows}):
        of = [row for row in rows if _case(row) == case]
        number, time_s = (
            np.array([row[key] for row in of]) for key in ("frequencies", "duration_s")
        )
        slope_deg, motion, changes = case
        name = f"{motion}, `{changes}`" if changes else motion
        lines.append(
            f"| {slope_deg:g} | {name} | {len(of)} | {sum(row['has_arrived'] for row in of)} "
            f"| {time_s.min():.0f} to {time_s.max():.0f} "
            f"| {np.median(number):.1f} ({number.min():.1f} to {number.max():.1f}) |"
        )
    return "\n".join(lines)


def _case(row: dict[str, Any]) -> tuple[float, str, str]:
    return row["slope_deg"], row["motion"], row.get("changes", "")


def main() -> None:
    """Measure what the file does not have, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slopes", type=float, nargs="+", default=[0.2, 12.0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--motions", nargs="+", default=["walk", "serpenoid"])
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", dest="changes")
    parser.add_argument("-o", "--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = read_lines(asked.out, dict, "a row of this benchmark")
    done = {(*_case(row), row["seed"]) for row in rows}
    name = " ".join(asked.changes)
    planned = [
        (slope_deg, motion, seed)
        for seed in range(asked.first_seed, asked.first_seed + asked.seeds)
        for slope_deg in asked.slopes
        for motion in asked.motions
    ]
    finished = (
        (case, measured(*case, asked.changes))
        for case in planned
        if (*case[:2], name, case[2]) not in done
    )
    rows += [row for _, row in append_lines(asked.out, finished, dict)]
    print(table(rows))


if __name__ == "__main__":
    main()
