"""Signals and faults of the system in every phase of a run: no traceback, and no lost log.

A child runs a simulated gait of one second. The limits are those of the kernel (``setrlimit``), so
the faults are real; a signal comes from the child itself when it enters a phase.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from snakewalk.controller.runlog.reader import LogError, read_log

_CHILD: Final = """
import importlib, os, resource, signal, sys
limit, phase, number, count = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
signal.signal(signal.SIGINT, signal.default_int_handler)
if limit:
    # numba's cache and the libraries come first: the limit is for the run
    import snakewalk.controller.run.kinds.gait_factory, snakewalk.sim.physics.body
    resource.setrlimit(getattr(resource, limit), (number, number))
else:
    path, _, name = phase.rpartition(".")
    module, _, owner = path.rpartition(":")
    place = importlib.import_module(module)
    place = getattr(place, owner) if owner != "-" else place
    original = getattr(place, name)
    calls = iter(range(1, 10**9))
    def phased(*args, **options):
        if next(calls) == count:
            os.kill(os.getpid(), number)
        return original(*args, **options)
    setattr(place, name, phased)
from snakewalk.controller.cli.main import main
sys.argv = ["snakewalk", "gait", "run", "lateral-undulation", "--seconds", "1", "--no-film",
            "--out", "run"]
main()
"""
_RUNLOG: Final = "snakewalk.controller.runlog.writer:RunLog"
_RUN: Final = "snakewalk.controller.run.run_robot:-"
PHASES: Final = {
    "log opened": (f"{_RUNLOG}.__enter__", 1),
    "configuration": (f"{_RUNLOG}.config", 1),
    "first cycle": (f"{_RUNLOG}.cycle", 1),
    "second cycle": (f"{_RUNLOG}.cycle", 2),
    "cycle 10": (f"{_RUNLOG}.cycle", 10),
    "cycle 40": (f"{_RUNLOG}.cycle", 40),
    "an event": (f"{_RUNLOG}.event", 1),
    "log closed": (f"{_RUNLOG}.__exit__", 1),
    "log read back": (f"{_RUN}.read_log", 1),
    "summary": (f"{_RUN}.write_summary", 1),
}
SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
CASES: Final = [
    *(
        pytest.param("", phase, number, id=f"{number.name} at {phase}")
        for phase in PHASES
        for number in SIGNALS
    ),
    *(
        pytest.param("RLIMIT_FSIZE", "", size, id=f"files of at most {size} bytes")
        for size in (0, 1, 8, 100, 1000, *range(2_000, 42_000, 2_000), 60_000, 100_000, 150_000)
    ),
    *(
        pytest.param("RLIMIT_NOFILE", "", count, id=f"at most {count} open files")
        for count in (*range(4, 33), 40, 48, 64)  # with 3, Python cannot import a module
    ),
]


def test_there_are_a_hundred_cases() -> None:
    assert len(CASES) >= 100


@pytest.mark.slow_cases(6, "100 runs of 3 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize(("limit", "phase", "number"), CASES)
def test_a_fault_leaves_no_traceback_and_no_unreadable_log(
    limit: str, phase: str, number: int, tmp_path: Path
) -> None:
    place, count = PHASES.get(phase, ("", 0))
    ended = subprocess.run(
        [sys.executable, "-c", _CHILD, limit, place, str(int(number)), str(count)],
        cwd=tmp_path,
        env=os.environ
        | {
            "XDG_RUNTIME_DIR": str(tmp_path),
            "PYTHONPATH": os.pathsep.join(sys.path),
            # Python renames a cache file that it could write in part only
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    said = ended.stderr
    assert "Traceback" not in said, said
    if number == signal.SIGKILL and not limit:
        assert ended.returncode == -signal.SIGKILL
    elif ended.returncode:
        assert "snakewalk:" in said or "interrupted" in said or "ended" in said, said
        assert ended.returncode != 2, said
    logs = [*tmp_path.glob("run/log.mcap*")]
    if not logs:
        return
    if is_empty(logs[0]):
        assert limit or PHASES[phase][0].split(".")[-1] in ("__enter__", "config")
    else:
        assert ended.returncode or len(read_log(logs[0]).cycle.time_s) > 40


def is_empty(log: Path) -> bool:
    """Whether nothing was in a log before the fault; any other fault of it is raised."""
    try:
        read_log(log)
    except LogError as fault:
        if "ends before its header" in str(fault) or "is not an MCAP log" in str(fault):
            return True
        raise
    return False
