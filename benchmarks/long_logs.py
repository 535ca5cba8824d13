"""Peak memory and processor time of the commands that read a log, for logs of several lengths.

The log is the recorded run of ``snakewalk demo`` (16 servos, 50 Hz), repeated. ``python -m
benchmarks.long_logs --hours 1 2 --folder FOLDER`` prints one table.
"""

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np

from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.view.commands.demo import RECORDED
from tests.helpers.long_log import repeat_log

REPEATS_PER_HOUR: Final = 88
COMMANDS: Final = {
    "log report --no-film": ("log", "report", "{log}", "--no-film", "--out", "{out}/report"),
    "log export --csv": ("log", "export", "{log}", "--csv", "{out}/csv"),
    "log judge": ("log", "judge", "{truth}", "{log}", "--json"),
    "log compare": ("log", "compare", "{log}", str(RECORDED), "--json"),
    "view": ("view", "{log}", "--view-at", "127.0.0.1:0"),
    "log replay": ("log", "replay", "{log}", "--json"),
}
_PROGRAM: Final = "from snakewalk.controller.cli.main import main; main()"


def measured(words: Sequence[str]) -> tuple[float, float, int]:
    """Return peak memory (MB), processor time (s) and exit code of a command.

    ``view`` is interrupted when it has printed its address: the log is then read and drawn.
    """
    child = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, *words],
        stdout=subprocess.PIPE if words[0] == "view" else subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )
    if child.stdout is not None:
        child.stdout.readline()
        child.send_signal(signal.SIGINT)
        child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_maxrss / 1e3, usage.ru_utime + usage.ru_stime, child.returncode


def write_truth(log: Path, path: Path, times: int) -> None:
    """Write the poses of a log, repeated as by ``repeat_log``, as the truth of a served robot."""
    record = read_log(log)
    header = record.header
    deadline_s = record.cycle.deadline_s
    period_s = deadline_s[-1] + deadline_s[1] - 2.0 * deadline_s[0]
    with path.open("w", encoding="utf-8") as file:
        first = {
            "snakewalk_truth": 1,
            "robot": header.robot.model_dump(mode="json"),
            "world": header.world.model_dump(mode="json"),
        }
        file.write(json.dumps(first) + "\n")
        pose = record.pose
        time_s, head_m, rotation, centre_m = (
            pose.time_s,
            pose.head_m,
            pose.rotation,
            pose.centre_m,
        )
        for count, k in product(range(times), range(len(time_s))):
            moved_s = round(float(time_s[k] + count * period_s), 6)
            row = {
                "sequence": count * len(time_s) + k,
                "time_s": moved_s,
                "sent_s": moved_s,
                "head_m": np.round(head_m[k], 6).tolist(),
                "rotation": np.round(rotation[k].ravel(), 7).tolist(),
                "centre_m": np.round(centre_m[k], 6).tolist(),
                "energy_j": [0.0, 0.0],
            }
            file.write(json.dumps(row) + "\n")


def main() -> None:
    """Measure, and print a row for each command and length."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.long_logs", description=__doc__)
    parser.add_argument("--hours", type=float, nargs="+", default=[1.0, 2.0])
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    parser.add_argument("--folder", type=Path, required=True, help="logs are kept there")
    given = parser.parse_args()
    print("| command | hours | log, MB | peak memory, MB | CPU, s | exit code |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |", flush=True)
    for hours in given.hours:
        log = given.folder / f"log{hours:g}.mcap"
        truth = given.folder / f"truth{hours:g}.jsonl"
        if not log.exists():
            repeat_log(RECORDED, log, round(REPEATS_PER_HOUR * hours))
        if "log judge" in given.commands and not truth.exists():
            write_truth(RECORDED, truth, round(REPEATS_PER_HOUR * hours))
        for name in given.commands:
            out = given.folder / f"out{hours:g}"
            words = [word.format(log=log, truth=truth, out=out) for word in COMMANDS[name]]
            memory_mb, cpu_s, code = measured(words)
            size_mb = log.stat().st_size / 1e6
            row = f"| `{name}` | {hours:g} | {size_mb:.0f} | {memory_mb:.0f} | {cpu_s:.0f} "
            print(f"{row}| {code} |", flush=True)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3, "MB here", file=sys.stderr)


if __name__ == "__main__":
    main()
