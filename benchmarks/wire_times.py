"""What happened on the line and when: shared by the paced servos and the program that is measured.

The servos' end of a pseudo-terminal hears of a packet tens of microseconds after it was written,
when a worker of the kernel has passed it on. A UART sends meanwhile. So a library preloaded into
the measured program (``write_times.c``) notes when each ``write`` has returned, and the servos
reckon from there. They in turn note when the last byte of an answer was due, and when they wrote
it. All times are of the monotonic clock, ns.
"""

import mmap
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

KEPT = 1024
_WRITES, _ANSWERS, _LOST = 0, 1, 2
_NUMBERS = 3
_HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer."""

    asked_ns: int
    """When the ``write`` with the question had returned."""
    heard_ns: int
    """When the servos' end heard of it."""
    due_ns: int
    """When the last byte has to be there."""
    given_ns: int
    """When it was written."""


class WireTimes:
    """The file, mapped."""

    def __init__(self, path: Path) -> None:
        with path.open("r+b") as file:
            mapped = mmap.mmap(file.fileno(), 0)
        whole = np.frombuffer(mapped, np.int64)
        self._numbers = whole[:_NUMBERS]
        self._writes = whole[_NUMBERS : _NUMBERS + 3 * KEPT].reshape(KEPT, 3)
        self._answers = whole[_NUMBERS + 3 * KEPT :].reshape(KEPT, 4)

    @staticmethod
    def create(path: Path) -> "WireTimes":
        """An empty file."""
        path.write_bytes(bytes(8 * (_NUMBERS + 7 * KEPT)))
        return WireTimes(path)

    @property
    def write_count(self) -> int:
        """Of writes so far."""
        return int(self._numbers[_WRITES])

    @property
    def lost(self) -> int:
        """How often something was written that the servos' end has not heard."""
        return int(self._numbers[_LOST])

    def write(self, index: int) -> tuple[int, int, int]:
        """When a write began and had returned, and how many bytes there were up to its end."""
        begun_ns, done_ns, total = self._writes[index % KEPT].tolist()
        return begun_ns, done_ns, total

    @property
    def answer_count(self) -> int:
        """Of answers so far; each is counted just after it was given."""
        return int(self._numbers[_ANSWERS])

    def answer(self, index: int) -> Answer:
        """One of the last."""
        return Answer(*self._answers[index % KEPT].tolist())

    def add_answer(self, answer: Answer) -> None:
        """Note one."""
        row = answer.asked_ns, answer.heard_ns, answer.due_ns, answer.given_ns
        self._answers[int(self._numbers[_ANSWERS]) % KEPT] = row
        self._numbers[_ANSWERS] += 1

    def add_lost(self) -> None:
        """Note that something was not heard."""
        self._numbers[_LOST] += 1


def build_library(folder: Path) -> Path | None:
    """The library to preload; None without a C compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    made = folder / "write_times.so"
    source = _HERE / "write_times.c"
    command = [compiler, "-O2", "-shared", "-fPIC", "-o", str(made), str(source), "-ldl"]
    subprocess.run(command, check=True)
    return made
