"""What is known before a servo moves, whatever the motion: what ``execute`` carries out."""

from collections.abc import Callable
from typing import Protocol

from config.errors import InputError
from config.heightfield import HeightField
from config.robot import RobotConfig
from config.run import RunConfig
from config.world import WorldConfig
from controller.app.prepare import Prepared
from controller.app.prepare_playback import PreparedPlayback
from controller.app.prepared_gait import PreparedGait
from controller.runtime.guide import Guide
from drivers.telemetry.record import Laid, PlanSummary

Say = Callable[[str, str], None]
"""Told (kind, text) of what the motion decides by itself."""


class Job(Protocol):
    """A run, ready."""

    @property
    def run(self) -> RunConfig:
        """As given."""
        ...

    @property
    def robot(self) -> RobotConfig:
        """As its servos will be set up."""
        ...

    @property
    def world(self) -> WorldConfig:
        """As given."""
        ...

    @property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        ...

    @property
    def gain(self) -> float:
        """Predicted speed over pulse speed."""
        ...

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        ...

    def laid(self) -> Laid:
        """How a simulated robot is laid down."""
        ...

    def judged(self) -> PlanSummary:
        """Judge the plan on paper; raises InputError where it breaks a limit of the robot."""
        ...

    def guide(self, say: Say) -> Guide:
        """Return a fresh guide."""
        ...


def job_of(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> Job:
    """Make a job again of what a log says."""
    if run.motion == "gait":
        return PreparedGait(run, robot, world)
    if run.motion == "playback":
        return PreparedPlayback(run, robot, world)
    if run.motion == "repertoire":
        raise InputError(f"run {run.name}: made again by: snakewalk repertoire run PLAN")
    if not run.waypoints_m:
        raise InputError(f"run {run.name}: a {run.motion} needs waypoints")
    return Prepared(run, robot, world)
