"""Late cycles of a run whose program may use a fifth of a processor core.

``python -m benchmarks.cpu_quota`` runs a gait at 50 Hz with the command of a user, with its log, on
16 servos that another process serves on a pseudo-terminal. The program runs from its start under a
CPU quota of the kernel (a control group of version 2 or 1; needs write access to it), or without
one (``--limiter stop``) is stopped and continued. In version 1 the same share limits its real-time
priority. ``--minutes 10`` is the long version. With ``--write`` it replaces the table of
``docs/how-to/small-computer.md``.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Thread
from typing import Final

import numpy as np

from benchmarks.host_cycle import COMMANDS, PATIENT, START_S, cpu_s, served, started
from benchmarks.provenance import provenance, write_tables
from snakewalk.controller.metrics.timing import skipped_cycles
from snakewalk.controller.runlog.reader import read_log

SHARE: Final = 0.2
"""Share of a core."""
PERIOD_S: Final = 0.1
"""Period of the quota: that of the kernel."""
STOP_PERIOD_S: Final = 0.005
"""Period of a stopped process: a part of a cycle."""
GROUPS: Final = Path("/sys/fs/cgroup")
AFTER_S: Final = 1.0
"""Time at the end of the motion that is not measured."""


@dataclass(frozen=True)
class Limits:
    """A program under a quota."""

    kind: str
    throttled: Callable[[], int]
    """Periods so far in which the program had to wait."""
    lift: Callable[[], None]
    """Ends the quota."""


@dataclass(frozen=True)
class Outcome:
    """What a run under a quota did."""

    limiter: str
    start_cpu_s: float
    """CPU time until the first cycle was logged."""
    cycles: int
    late: int
    """Deadlines that passed without a cycle."""
    waited: int
    """Of them, those in cycles that waited for replies of the served servos."""
    late_at_s: tuple[float, ...]
    """Times of the first ten of them, from the first cycle."""
    lateness_ms: tuple[float, float, float]
    """Median, 99 %, most."""
    cpu_ms: float
    """CPU time of a cycle."""
    throttled: int
    """Periods in which the program had to wait: its quota was used up, or it was stopped."""
    scheduling: str
    """Priority of the control loop."""
    load: float
    """Load average of the machine at the end."""


def main() -> None:
    """Measure, show, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cpu_quota", description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.5, help="length of the motion")
    parser.add_argument("--limiter", choices=("quota", "stop"), default="quota")
    parser.add_argument("--write", action="store_true", help="replace the table of the page")
    given = parser.parse_args()
    outcome = measured(60.0 * given.minutes, given.limiter)
    command = f"python -m benchmarks.cpu_quota {' '.join(sys.argv[1:])}".strip()
    text = f"{provenance(command)}\n\n{table(outcome)}"
    print(text)
    if given.write:
        write_tables("how-to/small-computer", "quota", text)


def table(outcome: Outcome) -> str:
    """Return the outcome as Markdown."""
    median, nearly_all, most = outcome.lateness_ms
    rows = {
        "limiter": outcome.limiter,
        "CPU time until the first logged cycle, s": f"{outcome.start_cpu_s:.1f}",
        "cycles": f"{outcome.cycles:,}",
        "late cycles (deadlines that passed)": f"{outcome.late:,}",
        "of them, in cycles that waited for replies": f"{outcome.waited:,}",
        "their times, at most ten, s": ", ".join(f"{t:.1f}" for t in outcome.late_at_s) or "none",
        "began late: median, 99 %, most, ms": f"{median:.2f}, {nearly_all:.2f}, {most:.2f}",
        "CPU time of a cycle, ms": f"{outcome.cpu_ms:.2f}",
        "periods in which the program had to wait": f"{outcome.throttled:,}",
        "priority of the control loop": outcome.scheduling,
        "load average of the machine": f"{outcome.load:.1f}",
    }
    lines = ["| quantity | value |", "| --- | ---: |"]
    return "\n".join([*lines, *(f"| {name} | {value} |" for name, value in rows.items())])


def measured(seconds: float, limiter: str) -> Outcome:
    """Run once.

    Raises:
        SystemExit: the run failed, or there is no quota on this machine.

    """
    with TemporaryDirectory() as folder, served() as port:
        out = Path(folder) / "run"
        words = [*COMMANDS["gait"], "--port", port, "--no-film", "--out", str(out)]
        words += ["--seconds", str(seconds)]
        for each in PATIENT:
            words += ["--set", each]
        code = Path(__file__).resolve().parents[1]
        with (
            started(code, *words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as run,
            (quota if limiter == "quota" else stopped)(run.pid) as limits,
        ):
            _wait_for_cycles(run, out / "log.mcap.part")
            start_cpu_s, throttled = cpu_s(run.pid), limits.throttled()
            begun_s = time.monotonic()
            time.sleep(max(seconds - AFTER_S, 1.0))
            used_s = cpu_s(run.pid) - start_cpu_s
            window_s = time.monotonic() - begun_s
            throttled = limits.throttled() - throttled
            scheduling = _scheduling(run.pid)
            load = os.getloadavg()[0]
            limits.lift()  # the report of the run is not part of the loop
            errors = run.communicate()[1]
        record = read_log(out / "log.mcap")
        ran_s = float(record.cycle.time_s[-1] - record.cycle.time_s[0])
        if ran_s < seconds - AFTER_S:
            raise SystemExit(f"the run ended after {ran_s:.1f} s of {seconds:g} s: {errors}")
        late_ms, skipped = 1e3 * record.cycle.lateness_s, skipped_cycles(record)
        late_at_s = (record.cycle.time_s - record.cycle.time_s[0])[1:][skipped > 0][:10]
        return Outcome(
            limits.kind,
            start_cpu_s,
            len(late_ms),
            int(skipped.sum()),
            int(skipped[~record.cycle.valid[:-1].all(axis=1)].sum()),
            tuple(float(time_s) for time_s in late_at_s),
            (float(np.median(late_ms)), float(np.quantile(late_ms, 0.99)), float(late_ms.max())),
            1e3 * used_s / window_s * record.period_s,
            throttled,
            scheduling,
            load,
        )


def _scheduling(process: int) -> str:
    """Return how the kernel schedules the main thread of a process."""
    if os.sched_getscheduler(process) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR:
        return f"real time, {os.sched_getparam(process).sched_priority}"
    return f"niceness {os.getpriority(os.PRIO_PROCESS, process)}"


def _wait_for_cycles(run: "subprocess.Popen[str]", log: Path) -> None:
    """Wait until the log has its first cycles."""
    end_s = time.monotonic() + START_S
    while not (log.exists() and log.stat().st_size > 20_000):
        if run.poll() is not None or time.monotonic() > end_s:
            run.kill()
            raise SystemExit(f"no run: {run.communicate()[1]}")
        time.sleep(0.05)


@contextmanager
def quota(process: int) -> Iterator[Limits]:
    """Put a process into a control group with a quota."""
    quota_us, period_us = round(1e6 * SHARE * PERIOD_S), round(1e6 * PERIOD_S)
    name, unlimited = f"snakewalk-quota-{os.getpid()}", "max"
    is_new = (GROUPS / "cgroup.controllers").exists()
    group = (GROUPS if is_new else GROUPS / "cpu") / name
    try:
        group.mkdir()
        if is_new:
            file = group / "cpu.max"
            file.write_text(f"{quota_us} {period_us}")
        else:
            file, unlimited = group / "cpu.cfs_quota_us", "-1"
            (group / "cpu.cfs_period_us").write_text(str(period_us))
            file.write_text(str(quota_us))
            with suppress(OSError):  # a kernel without it
                (group / "cpu.rt_period_us").write_text(str(period_us))
                (group / "cpu.rt_runtime_us").write_text(str(quota_us))
        (group / "cgroup.procs").write_text(str(process))
    except OSError as error:
        if group.exists():
            group.rmdir()
        raise SystemExit(f"{group}: no CPU quota ({error}); use --limiter stop") from None

    def throttled() -> int:
        words = (group / "cpu.stat").read_text().split()
        return int(words[words.index("nr_throttled") + 1])

    try:
        yield Limits(
            f"quota of a control group, version {2 if is_new else 1}",
            throttled,
            lambda: _write(file, unlimited),
        )
    finally:
        parent = group.parent / "cgroup.procs"
        for each in (group / "cgroup.procs").read_text().split():
            _write(parent, each)
        group.rmdir()


def _write(file: Path, text: str) -> None:
    file.write_text(text)


@contextmanager
def stopped(process: int) -> Iterator[Limits]:
    """Stop a process after its share of each short period, whether it used the share or not."""
    lifted, stops = Event(), [0]

    def work() -> None:
        while not lifted.wait(SHARE * STOP_PERIOD_S):
            os.kill(process, signal.SIGSTOP)
            stops[0] += 1
            lifted.wait((1.0 - SHARE) * STOP_PERIOD_S)
            os.kill(process, signal.SIGCONT)

    thread = Thread(target=work)
    thread.start()

    def lift() -> None:
        lifted.set()
        thread.join()

    try:
        yield Limits("stopped for 4 ms of each 5 ms", lambda: stops[0], lift)
    finally:
        lift()


if __name__ == "__main__":
    main()
