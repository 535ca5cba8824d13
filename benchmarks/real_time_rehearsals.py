"""Rehearsals in real time: `bus serve`, `run` and `log judge` over a pseudo-terminal and UDP.

The server has one core, the client another. A row states how late the server served and how late
the cycles of the client were. A run whose server was late by more than 0.1 s is void: its servos
replied when the client did not listen any more, which no real servo does.

python -m benchmarks.real_time_rehearsals --seeds 3 --first-seed 5000 -o real-time.jsonl

The command continues its file.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from snakewalk.controller.rehearsal.rehearsal import RUNS, generator, moved
from snakewalk.controller.rehearsal.result_lines import append_lines, read_lines
from snakewalk.controller.run.external.served_robot import place_of
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.runlog.reader import read_log

PROGRAM = (str(Path(sys.executable).with_name("snakewalk")),)
TRACKER = ("noise_m=0.01", "noise_deg=3", "delay_s=0.1")
UDP = "udp:127.0.0.1:9870"
VOID_S = 0.1


def rehearsed(run: str, seed: int) -> dict[str, Any]:
    """Serve a run's robot, run it on the pseudo-terminal, and return a row of the file."""
    place = moved(place_of(prepare_job(run, seed=seed)), generator(seed))
    x_m, y_m = place.start_m
    heading_deg = np.degrees(place.heading_rad)
    with TemporaryDirectory() as folder:
        serve = ["bus", "serve", "--run", run, "--link", "tty", "--pose-out", UDP, "--json"]
        serve += ["--truth", "truth.jsonl", "--seed", str(seed)]
        serve += [f"--at={x_m:.4f},{y_m:.4f},{heading_deg:.3f}"]
        serve += [word for error in TRACKER for word in ("--tracker", error)]
        server = subprocess.Popen(
            [*_on_core(0), *PROGRAM, *serve], cwd=folder, stdout=subprocess.PIPE, text=True
        )
        assert server.stdout is not None
        server.stdout.readline()  # it prints the port when it serves
        client = ["run", run, "--port", "./tty", "--pose", UDP, "--no-film", "--out", "run"]
        client += ["--seed", str(seed), "--json"]
        ran = subprocess.run(
            [*_on_core(1), *PROGRAM, *client],
            check=False, cwd=folder, capture_output=True, text=True,
        )  # fmt: skip
        server.send_signal(signal.SIGINT)
        counts = json.loads(server.communicate()[0].splitlines()[-1])
        row = {"run": run, "seed": seed, "exit_code": ran.returncode}
        log = Path(folder) / "run" / "log.mcap"
        if not log.exists():
            return row | {"error": ran.stderr.strip().splitlines()[-1:]}
        judged = subprocess.run(
            [*PROGRAM, "judge", "truth.jsonl", str(log), "--json"],
            check=False, cwd=folder, capture_output=True, text=True,
        )  # fmt: skip
        found: dict[str, Any] = json.loads(judged.stdout)
        return row | found | _lateness(log, float(counts["latest_s"]))


def _on_core(core: int) -> tuple[str, ...]:
    cores = sorted(os.sched_getaffinity(0))
    return ("taskset", "-c", str(cores[core % len(cores)]))


def _lateness(log: Path, served_late_s: float) -> dict[str, Any]:
    cycle = read_log(log).cycle
    late_ms = 1e3 * cycle.lateness_s[np.isfinite(cycle.lateness_s)]
    return {
        "served_late_s": served_late_s,
        "late_99_ms": float(np.percentile(late_ms, 99)),
        "late_max_ms": float(late_ms.max()),
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the rows as a table, one line for a run."""
    lines = [
        "| run | truly there | void | false claims | server late, ms | late in 1 of 100 cycles, ms "
        "| latest cycle, ms |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for run in dict.fromkeys(row["run"] for row in rows):
        of = [row for row in rows if row["run"] == run]
        valid = [row for row in of if row.get("served_late_s", 1.0) <= VOID_S]
        worst = {
            key: max((row[key] for row in of if key in row), default=np.nan)
            for key in ("served_late_s", "late_99_ms", "late_max_ms")
        }
        lines.append(
            f"| `{run}` | {sum(row['has_arrived'] for row in valid)} of {len(valid)} "
            f"| {len(of) - len(valid)} | {sum(not row['is_true'] for row in valid)} "
            f"| {1e3 * worst['served_late_s']:.0f} | {worst['late_99_ms']:.1f} "
            f"| {worst['late_max_ms']:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Rehearse what the file does not have, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=5000)
    parser.add_argument("-o", "--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = read_lines(asked.out, dict, "a row of this benchmark")
    done = {(row["run"], row["seed"]) for row in rows}
    planned = [
        (run, seed)
        for seed in range(asked.first_seed, asked.first_seed + asked.seeds)
        for run in RUNS
    ]
    finished = ((case, rehearsed(*case)) for case in planned if case not in done)
    rows += [row for _, row in append_lines(asked.out, finished, dict)]
    print(table(rows))


if __name__ == "__main__":
    main()
