"""CPU time of a program from its start until torque is on.

``python -m benchmarks.torque_start`` starts a gait and a walk with the commands of a user on 16
simulated servos, which this process serves on a pseudo-terminal, and watches their register Torque
Enable.
The loops must be compiled already (``snakewalk tools compile``). With ``--write`` it replaces the
table of ``docs/benchmarks/startup.md``.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.host_cycle import COMMANDS, PATIENT, cpu_s, started
from benchmarks.provenance import ROOT, provenance, write_tables
from snakewalk.sim.serve.servo_bus import ServoBus

LONGEST_S: Final = 60.0
"""Longest start."""
IMPORTS: Final = {
    "start of Python": "pass",
    "numpy": "import numpy",
    "numba": "import numba.np.arraymath",
    "one module with a compiled loop in the cache": "import snakewalk.drivers.protocol.frames",
    "the module of `gait run`": "import snakewalk.controller.run.commands.gait_run",
}
"""Programs that only import."""


def main() -> None:
    """Measure, show, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.torque_start", description=__doc__)
    parser.add_argument("--starts", type=int, default=5, help="of each program")
    parser.add_argument("--write", action="store_true", help="replace the table of the page")
    given = parser.parse_args()
    rows = [
        (f"import: {name}", sorted(_import_s(code) for _ in range(given.starts)))
        for name, code in IMPORTS.items()
    ]
    for name, words in COMMANDS.items():
        times = sorted(torque_s(name) for _ in range(given.starts))
        rows.append((f"torque is on: `{' '.join(words)}`", times))
    load = os.getloadavg()[0]
    lines = ["| until | least, s | median, s | most, s |", "| --- | ---: | ---: | ---: |"]
    for name, times in rows:
        shown = (f"{each:.2f}" for each in (times[0], times[len(times) // 2], times[-1]))
        lines.append(f"| {name} | {' | '.join(shown)} |")
    command = f"python -m benchmarks.torque_start {' '.join(sys.argv[1:])}".strip()
    about = f"{provenance(command)} n = {given.starts} each; load average {load:.1f}."
    text = "\n".join([about, "", *lines])
    print(text)
    if given.write:
        write_tables("startup", "torque", text)


def torque_s(name: str) -> float:
    """Return the CPU time of one program of ``COMMANDS`` until the first servo has torque.

    Raises:
        SystemExit: no torque came.

    """
    bus = ServoBus("1-16")
    try:
        with TemporaryDirectory() as folder:
            out = Path(folder) / "run"
            words = [*COMMANDS[name], "--port", bus.path, "--no-film", "--out", str(out)]
            for each in PATIENT:
                words += ["--set", each]
            with started(ROOT, *words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as run:
                try:
                    return _watched(run, bus)
                finally:
                    run.kill()
    finally:
        bus.close()


def _watched(run: "subprocess.Popen[str]", bus: ServoBus) -> float:
    end_s = time.monotonic() + LONGEST_S
    while not bus["Torque Enable"].any():
        if run.poll() is not None or time.monotonic() > end_s:
            run.kill()
            raise SystemExit(f"no torque: {run.communicate()[1]}")
        time.sleep(0.002)
    return cpu_s(run.pid)


def _import_s(code: str) -> float:
    """Return the CPU time of a Python process."""
    before = os.times()
    # the time to end the interpreter is left out
    subprocess.run([sys.executable, "-c", f"{code}; import os; os._exit(0)"], cwd=ROOT, check=True)
    after = os.times()
    used = after.children_user + after.children_system
    return used - before.children_user - before.children_system


if __name__ == "__main__":
    main()
