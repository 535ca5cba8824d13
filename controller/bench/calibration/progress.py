"""Progress of a calibration, saved after each answer so that an interruption loses none."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field

from snakewalk.config.base import Strict
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.interrupted_progress import read_progress
from snakewalk.controller.console.result_files import write_result


class SeenBend(Strict):
    """The joint that moved when a servo was wiggled."""

    joint: int = Field(description="number of the joint, from 0 at the head")
    """Which joint moved, counted from 0 at the head."""
    direction: Literal[1, -1] = Field(
        description="1 if the joint turns like the servo, -1 if it turns the other way"
    )
    """Direction of the first motion; 1: the head side was bent to the left (yaw) or lifted (pitch);
    -1: the other way."""


class JointRange(Strict):
    """Angles at which a joint met its stops."""

    low_rad: float | None = Field(description="lowest angle; none: not measured")
    """Lowest angle of the joint; None: not within ``BEYOND_RAD`` of the robot's limit."""
    high_rad: float | None = Field(description="highest angle; none: not measured")


class CalibrationProgress(Strict):
    """Facts about a chain so far; all tables are by servo ID."""

    joint_axes: str = Field(
        description="axis of each joint from head to tail: y for yaw, p for pitch"
    )
    """Axes of the robot that the chain is compared with."""
    servos: dict[int, str] = Field({}, description="model of each servo")
    """Models of the servos on the bus."""
    bends: dict[int, SeenBend] = Field({}, description="joint that each servo moves")
    zeros_rad: dict[int, float] = Field({}, description="angle of each servo in the straight body")
    """Positions of the straight body; empty until it was laid straight."""
    ranges: dict[int, JointRange] = Field(
        {}, description="angles at which each joint meets its stops"
    )

    def check_servos(self, servos: dict[int, str], source: str) -> None:
        """Compare with the servos on the bus.

        Raises:
            InputError: they are not the servos of this progress.

        """
        if self.servos and self.servos != servos:
            before, now = (
                ", ".join(map(str, servo_ids)) or "none" for servo_ids in (self.servos, servos)
            )
            raise InputError(
                f"{source}: has servos with ID {before}, the bus has {now}, or their models "
                "differ; connect the same servos, or start again with --force"
            )

    @property
    def summary(self) -> str:
        """Text such as ``5 of 16 joints known, not laid straight``."""
        straight = "laid straight" if self.zeros_rad else "not laid straight"
        joints = f"{len(self.bends)} of {len(self.joint_axes)} joints known, {straight}"
        return f"{joints}, {len(self.ranges)} ranges swept"


@dataclass
class Journal:
    """Progress of a calibration that is going on, and the function that saves it."""

    known: CalibrationProgress
    on_change: Callable[[CalibrationProgress], None] = lambda progress: None

    def note(self, **changes: object) -> None:
        """Add to the progress, and save it."""
        self.known = self.known.model_copy(update=changes)
        self.on_change(self.known)


class ProgressFile:
    """The file next to the robot's file that holds the progress until the robot's is written."""

    def __init__(self, robot_file: Path) -> None:
        self.path = robot_file.with_name(f"{robot_file.name}.part")
        """Path of the saved progress: ``my-robot.toml.part``."""

    def start(self, robot: RobotConfig, *, resume: bool, force: bool) -> Journal:
        """Return the journal to continue, or an empty one, which saves to the file.

        Args:
            robot: with the axes of the chain.
            resume: continue the file's.
            force: ignore a file that is there.

        Raises:
            InputError: the file to continue is missing or of another robot, or there is one and
                neither ``resume`` nor ``force`` is given.
            ConfigError: the file is broken.

        """
        if not resume:
            if self.path.exists() and not force:
                raise InputError(
                    f"{self.path}: holds the answers of an interrupted calibration; continue it "
                    "with --resume, or start again with --force"
                )
            return Journal(CalibrationProgress(joint_axes=robot.joint_axes), self.save)
        progress = self._read()
        if progress.joint_axes != robot.joint_axes:
            raise InputError(
                f"{self.path}: was made for joint_axes {progress.joint_axes}, robot {robot.name} "
                f"has {robot.joint_axes}; name the same --robot"
            )
        return Journal(progress, self.save)

    def save(self, progress: CalibrationProgress) -> None:
        """Write the file, whole or not at all; without an answer there is nothing to keep."""
        if not progress.bends:
            return
        write_result(self.path, progress.model_dump_json(indent=1))

    def remove(self) -> None:
        """Delete the file: the robot's file holds everything."""
        with suppress(FileNotFoundError):
            self.path.unlink()

    def _read(self) -> CalibrationProgress:
        return read_progress(self.path, CalibrationProgress)
