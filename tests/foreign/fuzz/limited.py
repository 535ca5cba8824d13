"""How an action ends in a process with limits of memory and time."""

import gc
import os
import pickle
import resource
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from snakewalk.config.errors import InputError

LEAST_MEMORY_BYTES: Final = 600_000_000
"""Memory that any read may add."""
MEMORY_RATIO: Final = 4
LEAST_CPU_S: Final = 10
CPU_RATIO: Final = 10
"""Multiples of a clean read that a damaged one may need."""


@dataclass(frozen=True)
class Cost:
    """Cost of a clean read."""

    memory_bytes: int
    cpu_s: float


@dataclass(frozen=True)
class Ended:
    """How an action ended: read, rejected, or a fault."""

    outcome: str
    words: str = ""
    cost: Cost = Cost(0, 0.0)


def _status(key: str) -> int:
    """Memory of this process in bytes, by its key in the system's table."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(key):
            return 1024 * int(line.split()[1])
    raise AssertionError(key)


def _limit(clean: Cost | None) -> None:
    if clean is None:
        return
    memory_bytes = max(LEAST_MEMORY_BYTES, MEMORY_RATIO * clean.memory_bytes)
    cpu_s = max(LEAST_CPU_S, int(CPU_RATIO * clean.cpu_s))
    for which, most in (
        (resource.RLIMIT_AS, _status("VmSize") + memory_bytes),
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(which, (most, resource.getrlimit(which)[1]))


def _ended(action: Callable[[], Any]) -> Ended:
    before, begun_s = _status("VmSize"), os.times()
    try:
        action()
    except InputError as error:
        if not error.faults or any(not line.strip() for line in error.faults):
            return Ended("fault", f"an InputError without words: {error.faults}")
        return Ended("rejected", str(error))
    except BaseException:
        return Ended("fault", traceback.format_exc())
    spent = [b - a for a, b in zip(begun_s[:4], os.times()[:4], strict=True)]
    return Ended("read", "", Cost(_status("VmPeak") - before, sum(spent)))


def run(action: Callable[[], Any], folder: Path, clean: Cost | None = None) -> Ended:
    """Run an action in a fork of this process; a clean read is measured and has no limits."""
    result, shown = folder / "result.pickle", folder / "shown.txt"
    result.unlink(missing_ok=True)
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        try:
            gc.disable()
            signal.signal(signal.SIGXCPU, signal.SIG_DFL)
            with shown.open("wb") as out:
                os.dup2(out.fileno(), 1)
                os.dup2(out.fileno(), 2)
            signal.alarm(300)  # a process that waits uses no CPU
            _limit(clean)
            result.write_bytes(pickle.dumps(_ended(action)))
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    said = shown.read_text(errors="replace") if shown.exists() else ""
    if os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        return Ended("fault", f"ended by {name}\n{said[-3000:]}")
    if not result.exists():
        return Ended("fault", f"ended without a result\n{said[-3000:]}")
    ended = pickle.loads(result.read_bytes())
    assert isinstance(ended, Ended)
    if "Traceback" in said:
        return Ended("fault", said[-3000:])
    return ended
