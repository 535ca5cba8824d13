"""Four simulated servos, served at a pseudo-terminal in real time, with their console."""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

PROGRAM = str(Path(sys.executable).with_name("snakewalk"))
ROBOT = 'name = "four"\njoint_axes = "yyyy"\n'
LONGEST_S = 240.0
"""Longest time of a command on a busy machine; it does not end by itself after that."""


class Served:
    """Four simulated servos at ``folder/port``, with their console."""

    def __init__(self, folder: Path, robot: str = ROBOT) -> None:
        (folder / "robot.toml").write_text(ROBOT, encoding="utf-8")
        (folder / "served.toml").write_text(robot, encoding="utf-8")
        self.port, self._log = folder / "port", folder / "serve.txt"
        words = ["bus", "serve", "--robot", "served.toml", "--link", "port", "--console"]
        with self._log.open("w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                [PROGRAM, *words], cwd=folder, text=True,
                stdin=subprocess.PIPE, stdout=log, stderr=log,
            )  # fmt: skip
        wait_for(self.port.is_symlink)

    def say(self, line: str) -> None:
        """Send a line to the console."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def torque(self) -> str:
        """Return ``on``, ``off``, ``watchdog`` (they hold the servos), or ``gone`` (no server)."""
        if self.process.poll() is not None:
            return "gone"
        if "1" not in self._values("Torque Enable"):
            return "off"
        return "watchdog" if set(self._values("Bus Watchdog")) == {"255"} else "on"

    def _values(self, register: str) -> list[str]:
        """Values of a register of all servos."""
        size = self._log.stat().st_size
        self.say(f"get 1-4 {register}")
        wait_for(lambda: self._log.read_text(encoding="utf-8")[size:].endswith("\n"))
        pairs = self._log.read_text(encoding="utf-8")[size:].split("  ")
        return [pair.split(":")[1].strip() for pair in pairs]

    def warnings(self) -> list[str]:
        """Lines that the server printed."""
        return self._log.read_text(encoding="utf-8").splitlines()

    def end(self) -> None:
        """End the server."""
        self.process.kill()
        self.process.wait()


def wait_for(is_true: Callable[[], bool]) -> None:
    """Wait until something is so.

    Raises:
        TimeoutError: it is not.

    """
    end_s = time.monotonic() + LONGEST_S
    while not is_true():
        if time.monotonic() > end_s:
            raise TimeoutError("the program does not get on; is the machine busy?")
        time.sleep(0.1)
