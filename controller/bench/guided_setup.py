"""The way from a new chain of servos to its first motion, step by step."""

import importlib.util
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import typer

from snakewalk.config.archive import read_json_object
from snakewalk.config.loader import load_robot
from snakewalk.controller.console.result_files import write_result

_GAIT = "lateral-undulation"
_REHEARSAL = "rehearsal"
"""Folder of the rehearsal's results."""
_SLOW = ("-p", "frequency_hz=0.2")
"""Frequency of the first motion (ours)."""
_SHORT = ("--seconds", "10", "--force", "--no-film")
"""Duration of the first motion (ours)."""
_REHEARSED_SHARE = 2.0
"""Current limit of the first motion over the peak of its rehearsal (ours)."""
_UNREHEARSED_SHARE = 0.5
"""The same over the robot's own limit, without a rehearsal (ours)."""
_DEAD_RECKONED = 3
"""Exit code of a successful run without a measured pose."""
_INTERRUPTED = 130
"""Exit code of a command that the person left at its own question."""


@dataclass(frozen=True, slots=True)
class RobotFiles:
    """The files of one robot, its port, its pose source and its axes."""

    folder: Path
    port: str
    axes: str = ""
    pose: str = ""

    @property
    def first_robot(self) -> Path:
        """Robot file of the servos on the bus."""
        return self.folder / "found.toml"

    @property
    def robot(self) -> Path:
        """Robot file with order, directions and zeros."""
        return self.folder / "robot.toml"

    def current_limit_a(self) -> float:
        """Return the current limit of the first motion: from its rehearsal, or of the robot."""
        robot_a = load_robot(str(self.robot)).over_current_a
        summary = self.folder / _REHEARSAL / "summary.json"
        peak_a = summary.exists() and read_json_object(summary).get("peak_current_a")
        limit_a = _REHEARSED_SHARE * peak_a if peak_a else _UNREHEARSED_SHARE * robot_a
        return round(min(limit_a, robot_a), 2)

    def on_port(self, *words: str) -> list[str]:
        """Return words of a command on the robot's port."""
        return [*words, "--port", self.port]


@dataclass(frozen=True, slots=True)
class SetupStep:
    """One step: its purpose, and the command that does it."""

    name: str
    purpose: str
    words: Callable[[RobotFiles], list[str]]
    if_skipped: str = ""
    """The assumption that replaces this step."""


def _find(files: RobotFiles) -> list[str]:
    return files.on_port(
        "bus", "inventory", "--axes", files.axes or "y", "-o", str(files.first_robot), "--force"
    )


def _examine(files: RobotFiles) -> list[str]:
    return files.on_port("doctor", "--robot", str(files.first_robot))


def _calibrate(files: RobotFiles) -> list[str]:
    begun = files.robot.with_name(f"{files.robot.name}.part").exists()
    again = "--resume" if begun else "--force"
    return files.on_port(
        "bus", "calibrate", "--robot", str(files.first_robot), "-o", str(files.robot), again
    )


def _gait(verb: str, files: RobotFiles) -> list[str]:
    return ["gait", verb, _GAIT, "--robot", str(files.robot), *_SLOW]


def _motion(files: RobotFiles, folder: str) -> list[str]:
    return [*_gait("run", files), *_SHORT, "-o", str(files.folder / folder)]


def _pose(files: RobotFiles) -> list[str]:
    return ["pose", "check", files.pose, "--robot", str(files.robot)] if files.pose else []


def _move(files: RobotFiles) -> list[str]:
    page = ["--view"] if importlib.util.find_spec("viser") else []
    limit = ["--set", f"run.safety.current_limit_a={files.current_limit_a():g}"]
    return [*files.on_port(*_motion(files, "first-motion"), *limit), *page]


STEPS = (
    SetupStep("find", "Find the servos: models, IDs, baud rates. Changes nothing.", _find),
    SetupStep("examine", "Examine adapter, bus and servos. Changes nothing.", _examine),
    SetupStep(
        "calibrate",
        "Find order, directions and zeros. HANG THE BODY UP: each servo moves weakly.",
        _calibrate,
        "the order of the joints is that of the IDs, every direction is +1, every zero is 0",
    ),
    SetupStep(
        "limits",
        "Compute angles and speeds of the first motion. Nothing moves.",
        partial(_gait, "show"),
    ),
    SetupStep(
        "rehearse",
        "The same motion with simulated servos and real packets.",
        partial(_motion, folder=_REHEARSAL),
    ),
    SetupStep("pose", "Check the external pose. Nothing moves.", _pose),
    SetupStep(
        "move",
        "FIRST MOTION: 10 s, slow, with a current limit. Hang the body up; a hand on the supply's "
        "switch. Ctrl-C or `snakewalk stop` switches torque off.",
        _move,
    ),
)


class GuidedSetup:
    """Asks before each step, runs its command, and remembers in the folder which are done."""

    def __init__(
        self,
        folder: Path,
        port: str | None,
        ask: Callable[[str], str],
        run: Callable[[Sequence[str]], int],
    ) -> None:
        """Read the state of an earlier setup.

        Args:
            folder: of the robot's files; it is created.
            port: of the servos; None: that of the earlier setup, or of a question.
            ask: asks a person and returns the answer.
            run: runs a command of this program and returns its exit code.

        """
        self._ask, self._run = ask, run
        self._file = folder / "setup.json"
        state = read_json_object(self._file) if self._file.exists() else {}
        self._done = list(state.get("done", ()))
        device = port or state.get("port") or ask("port of the servos, e.g. /dev/ttyUSB0")
        self.files = RobotFiles(folder, device)
        folder.mkdir(parents=True, exist_ok=True)

    def carry_on(self) -> None:
        """Run the remaining steps.

        Raises:
            SystemExit: the person stops; with the exit code of the last command of the step.
            InputError: the robot's file, or the rehearsal's results, are invalid.

        """
        while len(self._done) < len(STEPS):
            step = STEPS[len(self._done)]
            typer.echo(f"\n{len(self._done) + 1} of {len(STEPS)}  {step.purpose}")
            if step.name == "pose":
                question = "source, e.g. udp:9870 or ros:/pose; Enter: none, dead reckoning"
                self.files = replace(self.files, pose=self._ask(question))
            if step.name == "find":
                self.files = replace(self.files, axes=self._axes())
            if self._run_step(step):
                self._done.append(step.name)
            else:
                del self._done[-1:]
            write_result(
                self._file, json.dumps({"port": self.files.port, "done": self._done}) + "\n"
            )

    def _run_step(self, step: SetupStep) -> bool:
        """Run the step's command until it succeeds or is skipped; False: back to the last step."""
        code = 0
        words = step.words(self.files)
        while words:
            typer.echo(f"  snakewalk {' '.join(words)}")
            answer = self._ask("Enter: run it; s: skip; b: back; q: stop here").lower()
            if answer.startswith("q"):
                typer.echo(f"snakewalk setup {self.files.folder} goes on with this step", err=True)
                raise SystemExit(code)
            if answer.startswith("b"):
                return False
            if answer.startswith("s"):
                if self._can_skip(step):
                    break
                continue
            if answer not in ("", "y"):
                continue
            code = self._run(words)
            if code in (0, _DEAD_RECKONED):
                break
            if code != _INTERRUPTED:
                typer.echo(f"  exit code {code}: correct the faults above, then try again")
            words = step.words(self.files)
        return True

    def _can_skip(self, step: SetupStep) -> bool:
        """Tell what replaces the step, or which file is missing without it."""
        first = self.files.first_robot
        robot = self.files.robot
        if step.name in ("find", "calibrate") and not (first.exists() or robot.exists()):
            typer.echo(
                f"  {first} is missing, and every later step needs it: find the servos, or copy a "
                "robot file there"
            )
            return False
        if step.name == "calibrate" and not robot.exists():
            shutil.copyfile(first, robot)
        if step.if_skipped:
            typer.echo(f"  assumed: {step.if_skipped}")
        return True

    def _axes(self) -> str:
        """Ask for the axes, which no servo knows."""
        while True:
            word = self._ask(
                "axes from the head, a letter for each joint: y turns about the vertical, p lifts; "
                "a short word repeats; Enter: all y"
            )
            if set(word) <= {"y", "p"}:
                return word
            typer.echo(f"  '{word}': only the letters y and p")
