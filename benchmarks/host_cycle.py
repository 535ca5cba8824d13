"""CPU time and memory of a complete host cycle on a port, against another commit in the same run.

``python -m benchmarks.host_cycle --old COMMIT`` runs a gait and a walk at 50 Hz with the command of
a user, with its log, on 16 servos that another process serves on a pseudo-terminal. The code of
this folder and of the other commit take turns. CPU time is that of all threads of the program, in
a window of the run without its start and end. With ``--profile`` a sampling profiler (``py-spy``)
shows instead in which functions the main thread of a gait spends its time. With ``--write`` it
replaces the table of ``docs/how-to/small-computer.md``.
"""

import argparse
import os
import re
import subprocess
import sys
import tarfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.provenance import ROOT, provenance, write_tables
from snakewalk.controller.runlog.reader import read_log

ENTRY = re.compile(r'^snakewalk = "([\w.]+):main"', re.MULTILINE)
COMMANDS = {
    "gait": ("gait", "run", "lateral-undulation", "--robot", "yaw16"),
    "walk": ("run", "flat-slalom"),
}
PATIENT = (
    "run.safety.stale_limit_s=5",
    "run.safety.slow_stale_limit_s=20",
    "run.safety.watchdog_s=2.5",
    "run.safety.following_time_s=20",
)
"""On a busy machine the simulated servos reply late; the run continues."""
WARM_S = 4.0
"""Time after the first logged cycle that does not count: ramp, caches."""
START_S = 600.0
"""Longest start of a program; code without a cache is compiled first."""
PARTS = {
    "log": r"cycle_row\.py|runlog/",
    "one register for each cycle": r"chain/liveness\.py|goal_check\.py|_read_slow",
    "receiving the state": r"_receive \(",
    "decoding the state": r"control_cycle\.py|group_read\.py|_decode_state",
    "limits: state and goals": r"safety/(?!safe_link)|SafeLink\._check \(|_following_fault",
    "writing goals": r"SafeLink\.write|ServoChain\.write",
    "pose": r"controller/pose/",
    "gait": r"controller/motion/",
    "sleeping until the next cycle": r"sleep_until_s",
    "reading: the rest": r"SafeLink\.read",
    "the rest": "",
}
"""Parts of a cycle by the functions of a stack; the first that is found counts."""
RATE_HZ = 500
SHARE, MEMORY_MB = 0.6, 200.0
"""Targets: CPU time against the other commit, and peak of the resident memory."""


@dataclass(frozen=True)
class Cost:
    """Cost of one run."""

    cpu_ms: float
    """CPU time of a cycle."""
    memory_mb: float
    """Peak of the resident memory up to the end of the window."""


def code_of(commit: str, folder: Path) -> Path:
    """Extract the code of a commit into a folder."""
    archive = subprocess.run(
        ["git", "archive", commit], cwd=ROOT, stdout=subprocess.PIPE, check=True
    ).stdout
    with tarfile.open(fileobj=BytesIO(archive)) as packed:
        packed.extractall(folder, filter="tar")
    return folder


def started(
    code: Path, *words: str, stdout: int = subprocess.PIPE, stderr: int | None = None
) -> subprocess.Popen[str]:
    """Start ``snakewalk`` from a folder of code."""
    found = ENTRY.search((code / "pyproject.toml").read_text(encoding="utf-8"))
    assert found is not None
    program = f"import sys; sys.path.insert(0, {str(code)!r}); from {found[1]} import main; main()"
    return subprocess.Popen(
        [sys.executable, "-u", "-c", program, *words],
        cwd=code,
        text=True,
        stdout=stdout,
        stderr=stderr,
    )


@contextmanager
def served() -> Iterator[str]:
    """Serve 16 simulated servos by another process; yields their port."""
    with started(ROOT, "bus", "serve", "--servos", "1-16") as bus:
        assert bus.stdout is not None
        try:
            yield next(found[1] for line in bus.stdout if (found := re.match(r"port (\S+)", line)))
        finally:  # the exit of Popen waits for its process
            bus.kill()


def cpu_s(process: int) -> float:
    """CPU time of all threads of a process so far, s."""
    tasks = Path(f"/proc/{process}/task").iterdir()
    return sum(int((each / "schedstat").read_text().split()[0]) for each in tasks) * 1e-9


def peak_mb(process: int) -> float:
    """Peak of the resident memory of a process, MB."""
    text = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(re.search(r"VmHWM:\s+(\d+)", text)[1]) * 1024e-6  # type: ignore[index]


@contextmanager
def running(
    code: Path, motion: str, seconds: float
) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Run a motion that is warm for the next ``seconds``; its program, and its folder."""
    length_s = WARM_S + seconds + 4.0
    with TemporaryDirectory() as folder, served() as port:
        out = Path(folder) / "run"
        words = [*COMMANDS[motion], "--port", port, "--no-film", "--out", str(out)]
        words += ["--seconds", str(length_s)] if motion == "gait" else []
        for each in (*PATIENT, *([] if motion == "gait" else [f"run.time_limit_s={length_s}"])):
            words += ["--set", each]
        with started(code, *words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as run:
            part = out / "log.mcap.part"
            end_s = time.monotonic() + START_S
            while not (part.exists() and part.stat().st_size > 100_000):
                if run.poll() is not None or time.monotonic() > end_s:
                    run.kill()
                    raise SystemExit(f"{motion}: no run: {run.communicate()[1]}")
                time.sleep(0.1)
            time.sleep(WARM_S)
            yield run, out


def cost(code: Path, motion: str, seconds: float) -> Cost:
    """Run once, and measure in a window of ``seconds``."""
    with running(code, motion, seconds) as (run, out):
        begun_s, cpu = time.monotonic(), cpu_s(run.pid)
        time.sleep(seconds)
        cpu, window_s = cpu_s(run.pid) - cpu, time.monotonic() - begun_s
        memory = peak_mb(run.pid)
        errors = run.communicate()[1]
        cycle = read_log(out / "log.mcap").cycle
        ran_s = float(cycle.time_s[-1] - cycle.time_s[0])
        if ran_s < WARM_S + seconds:
            raise SystemExit(f"{motion}: ended after {ran_s:.1f} s: {errors}")
        cycles = len(cycle.time_s) / ran_s * window_s
    return Cost(1e3 * cpu / cycles, memory)


def part_of(stack: str) -> str:
    """Part of a cycle to which a stack belongs: functions and files, the innermost last."""
    return next(part for part, words in PARTS.items() if re.search(words, stack))


def profile(seconds: float) -> Counter[str]:
    """Samples of the main thread in each part of a cycle of a gait."""
    found = Counter[str]()
    with running(ROOT, "gait", seconds) as (run, out):
        stacks = out / "stacks.txt"
        words = ["-p", str(run.pid), "-d", f"{seconds:.0f}", "-r", str(RATE_HZ), "-o", str(stacks)]
        subprocess.run(
            ["py-spy", "record", "-f", "raw", *words], check=True, stdout=subprocess.DEVNULL
        )
        for line in stacks.read_text(encoding="utf-8").splitlines():
            stack, _, count = line.rpartition(" ")
            if "Drive.run" in stack:
                found[part_of(stack)] += int(count)
        run.communicate()
    return found


def shares(found: Counter[str]) -> str:
    """Markdown: parts of a cycle by their share."""
    total = found.total()
    lines = ["| part | share |", "| --- | ---: |"]
    lines += [f"| {part} | {count / total:.0%} |" for part, count in found.most_common()]
    return "\n".join(lines)


def table(found: dict[tuple[str, bool], list[Cost]], old: str) -> str:
    """Markdown; the ratio is the median of the rounds', in which both codes meet the same load."""
    lines = [
        f"| motion | CPU a cycle, ms | of `{old}`, ms | ratio (target {SHARE}) | of each round "
        f"| memory, MB (target {MEMORY_MB:.0f}) | of `{old}`, MB |",
        "| --- | ---: | ---: | ---: | --- | ---: | ---: |",
    ]
    for motion in COMMANDS:
        new, before = found[motion, True], found[motion, False]
        cpu, cpu_old = (min(each.cpu_ms for each in some) for some in (new, before))
        memory, memory_old = (max(each.memory_mb for each in some) for some in (new, before))
        ratios = [a.cpu_ms / b.cpu_ms for a, b in zip(new, before, strict=True)]
        each_ratio = ", ".join(f"{ratio:.2f}" for ratio in ratios)
        lines.append(
            f"| {motion} | {cpu:.2f} | {cpu_old:.2f} | {median(ratios):.2f} | {each_ratio} "
            f"| {memory:.0f} | {memory_old:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, show, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.host_cycle", description=__doc__)
    parser.add_argument("--old", default="cfafa2d918", metavar="COMMIT", help="to compare with")
    parser.add_argument("--old-code", type=Path, help="folder that has its code already")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each window")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="replace the table of the page")
    parser.add_argument("--profile", action="store_true", help="shares of functions instead")
    given = parser.parse_args()
    command = f"python -m benchmarks.host_cycle {' '.join(sys.argv[1:])}".strip()
    if given.profile:
        samples = profile(given.seconds)
        load = f"{samples.total():,} samples. Load average at the end: {os.getloadavg()[0]:.1f}."
        text = f"{provenance(command)} {load}\n\n{shares(samples)}"
        print(text)
        if given.write:
            write_tables("how-to/small-computer", "shares", text)
        return
    found: dict[tuple[str, bool], list[Cost]] = defaultdict(list)
    with TemporaryDirectory() as folder:
        old = given.old_code or code_of(given.old, Path(folder))
        for number in range(given.rounds):
            for motion in COMMANDS:
                for is_new in (False, True):
                    each = cost(ROOT if is_new else old, motion, given.seconds)
                    found[motion, is_new].append(each)
                    which = "this code" if is_new else given.old
                    print(f"round {number + 1}: {motion}, {which}: {each}", file=sys.stderr)
    load = f"Load average at the end: {os.getloadavg()[0]:.1f}."
    text = f"{provenance(command)} {load}\n\n{table(found, given.old)}"
    print(text)
    if given.write:
        write_tables("how-to/small-computer", "cost", text)


if __name__ == "__main__":
    main()
