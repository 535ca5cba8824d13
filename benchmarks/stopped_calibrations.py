"""Calibrations of served servos by a scripted person, ended at one of their stages, and resumed."""

import os
import re
import select
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.served_bus import LONGEST_S, PROGRAM, Served

_QUESTION = re.compile(
    r"ID (?P<id>\d+): which joint moved\?[^:]*: |a = again: |press (?P<enter>Enter): "
)


class Calibration:
    """``snakewalk bus calibrate`` in a terminal, whose questions get the right answers."""

    def __init__(self, folder: Path, *options: str) -> None:
        self._master, terminal = os.openpty()
        words = ["bus", "calibrate", "--robot", "robot.toml", "--port", "port", "-o", "out.toml"]
        self.process = subprocess.Popen(
            ["setsid", "--ctty", PROGRAM, *words, *options], cwd=folder,
            stdin=terminal, stdout=terminal, stderr=terminal,
        )  # fmt: skip
        os.close(terminal)
        self.text = ""
        self._answered = 0

    @property
    def asked(self) -> int:
        """Number of questions for a joint."""
        return self.text.count("which joint moved?")

    def run_until(self, stage: str) -> bool:
        """Answer until a text is printed or the command ends; whether the text was printed."""
        end_s = time.monotonic() + LONGEST_S
        while time.monotonic() < end_s and self._read():
            if stage and stage in self.text:
                return True
            question = _QUESTION.search(self.text, self._answered)
            if question is not None:
                self._answered = question.end()
                answer = question["id"] or ("" if question["enter"] else "l")
                os.write(self._master, f"{answer}\n".encode())
        return False

    def hang_up(self) -> None:
        """Close the terminal."""
        os.close(self._master)
        self._master = -1

    def end(self) -> int | str:
        """Return the exit code; kill a command that does not end."""
        while self._master >= 0 and self._read():
            pass
        if self._master >= 0:
            self.hang_up()
        try:
            return self.process.wait(LONGEST_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return "does not end"

    def _read(self) -> bool:
        """Read what is printed; False once the command has ended."""
        if select.select([self._master], [], [], 0.1)[0]:
            with suppress(OSError):  # the other end is closed
                data = os.read(self._master, 4096)
                self.text += data.decode(errors="replace")
                return True
        return self.process.poll() is None


def _signal(number: signal.Signals) -> Callable[[Calibration, Path], None]:
    return lambda calibration, folder: calibration.process.send_signal(number)


def _stop(calibration: Calibration, folder: Path) -> None:
    subprocess.run([PROGRAM, "stop", "--port", "port"], cwd=folder, check=False)


def _close(calibration: Calibration, folder: Path) -> None:
    calibration.hang_up()


_SCAN, _FIRST, _SIDE, _THIRD = "search for servos", "ID 1: which joint moved?", "1 is joint", "ID 3"
_STRAIGHT, _RANGE = "press Enter: ", "range of joint yaw_02"
STOPS: dict[str, tuple[str, Callable[[Calibration, Path], None]]] = {
    "SIGINT during the scan": (_SCAN, _signal(signal.SIGINT)),
    "SIGTERM during the scan": (_SCAN, _signal(signal.SIGTERM)),
    "SIGINT at the first question": (_FIRST, _signal(signal.SIGINT)),
    "SIGTERM at the question for the side": (_SIDE, _signal(signal.SIGTERM)),
    "SIGINT while servo 3 moves": (_THIRD, _signal(signal.SIGINT)),
    "closed terminal while servo 3 moves": (_THIRD, _close),
    "`snakewalk stop` while servo 3 moves": (_THIRD, _stop),
    "SIGKILL while servo 3 moves": (_THIRD, _signal(signal.SIGKILL)),
    "closed terminal before the body is straight": (_STRAIGHT, _close),
    "SIGTERM before the body is straight": (_STRAIGHT, _signal(signal.SIGTERM)),
    "SIGINT during the second sweep": (_RANGE, _signal(signal.SIGINT)),
    "closed terminal during the second sweep": (_RANGE, _close),
    "`snakewalk stop` during the second sweep": (_RANGE, _stop),
    "SIGKILL during the second sweep": (_RANGE, _signal(signal.SIGKILL)),
}
"""Name of a scenario: the text after which it acts, and its action."""


def stopped_calibration(name: str) -> str:
    """Play a scenario and the calibration that resumes it; returns its row."""
    stage, act = STOPS[name]
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        served = Served(folder)
        try:
            first = Calibration(folder)
            reached = first.run_until(stage)
            if reached:
                act(first, folder)
            code = first.end()
            time.sleep(2.0)  # the bus watchdogs
            torque = served.torque()
            answers = first.text.count("head side went first")
            again = Calibration(
                folder, *(["--resume"] if (folder / "out.toml.part").exists() else [])
            )
            again.run_until("")
            done = again.end()
        finally:
            served.end()
        result = "complete" if done == 0 and (folder / "out.toml").exists() else f"exit code {done}"
    if "Traceback" in first.text + again.text:
        result += ", traceback"
    where = name if reached else f"{name} (not reached)"
    return f"| {where} | {code} | {torque} | {answers} | {again.asked} | {result} |"
