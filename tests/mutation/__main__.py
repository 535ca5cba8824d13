"""``python -m tests.mutation``: run the tests on every mutant; writes ``docs/mutation.md``.

Each mutant gets a forked process with the changed module in place of the true one, the tests that
are about it, and a time limit. A mutant that no test notices must be explained in
``explained.toml``; without a reason the run ends with exit code 1.
"""

import os
import signal
import sys
import tomllib
from pathlib import Path
from types import ModuleType

os.environ["NUMBA_DISABLE_JIT"] = "1"  # a mutant's loops run as they stand: nothing to compile

import hypothesis  # noqa: F401  loaded once, for all forks
import numpy  # noqa: F401
import pytest
from rich.console import Console
from rich.progress import track

from tests.mutation.mutants import Mutant, mutants

ROOT = Path(__file__).resolve().parents[2]
DOC = ROOT / "docs" / "mutation.md"
BEGIN, END = "<!-- mutation begins -->", "<!-- mutation ends -->"
TIME_LIMIT_S = 60
TARGETS = {
    "snakewalk.drivers.safety.vet": (
        "test_safety_edges.py",
        "test_safety_vet.py",
        "test_safe_link.py",
    ),
    "snakewalk.drivers.safety.following_error": (
        *("test_following_error.py", "test_constant_current.py"),
    ),
    "snakewalk.drivers.safety.measured_step": ("test_measured_step.py",),
    "snakewalk.drivers.chain.goal_check": ("test_goal_check_edges.py",),
    "snakewalk.drivers.chain.fingerprint": ("test_fingerprint.py",),
    "snakewalk.drivers.chain.temperature_sensors": ("test_temperature_sensors.py",),
    "snakewalk.drivers.chain.motion_sensors": (
        *("test_motion_sensors_edges.py", "test_motion_sensors.py"),
    ),
    "snakewalk.drivers.chain.lost_replies": ("test_lost_replies.py",),
    "snakewalk.drivers.protocol.parser": (
        *("test_reader_edges.py", "test_packet_reader.py", "test_packets.py"),
        "test_crc_and_stuffing.py",
    ),
    "snakewalk.drivers.protocol.packet": (
        *("test_reader_edges.py", "test_packets.py", "test_crc_and_stuffing.py"),
    ),
}


def survives(module: str, mutant: Mutant, tests: tuple[str, ...]) -> bool:
    """Whether no test fails on ``mutant``; a mutant that runs for ever does not."""
    child = os.fork()
    if child == 0:
        os._exit(_try(module, mutant, tests))
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status) == 0


def _try(module: str, mutant: Mutant, tests: tuple[str, ...]) -> int:
    signal.alarm(TIME_LIMIT_S)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    changed = ModuleType(module)
    changed.__file__ = str(ROOT / (module.replace(".", "/") + ".py"))
    sys.modules[module] = changed
    try:
        exec(compile(mutant.source, changed.__file__, "exec"), changed.__dict__)
        parent, _, name = module.rpartition(".")
        setattr(__import__(parent, fromlist=[name]), name, changed)
    except Exception:
        return 1
    files = [str(file) for name in tests for file in (ROOT / "tests" / "drivers").rglob(name)]
    words = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0"]
    return int(pytest.main([*words, *files]))


def main() -> None:
    """Run all targets, or those named on the command line."""
    named = sys.argv[1:] or list(TARGETS)
    explained = tomllib.loads(Path(__file__).with_name("explained.toml").read_text("utf-8"))
    rows, reasons, unexplained = [], [], []
    for module in named:
        source = (ROOT / (module.replace(".", "/") + ".py")).read_text(encoding="utf-8")
        every = list(mutants(source))
        left = [
            mutant
            for mutant in track(every, module, console=Console(stderr=True))
            if survives(module, mutant, TARGETS[module])
        ]
        known = explained.get(module, {})
        for mutant in left:
            reason = known.get(mutant.name)
            reasons.append(f"- `{module}`: `{mutant.name}`: {reason}")
            if reason is None:
                unexplained.append(f"{module}:{mutant.line}: {mutant.name}")
        rows.append(f"| `{module}` | {len(every)} | {len(every) - len(left)} | {len(left)} |")
    head = ["| module | mutants | noticed | surviving, explained |", "| --- | ---: | ---: | ---: |"]
    shown = "\n".join([*head, *rows, "", *reasons])
    print(shown)
    if not sys.argv[1:] and DOC.is_file():
        text = DOC.read_text(encoding="utf-8")
        kept = f"{text.split(BEGIN)[0]}{BEGIN}\n{shown}\n{END}{text.split(END)[-1]}"
        DOC.write_text(kept, encoding="utf-8")
    if unexplained:
        print("not explained:", *unexplained, sep="\n", file=sys.stderr)
        raise SystemExit(1)


if __name__ == "__main__":
    main()
