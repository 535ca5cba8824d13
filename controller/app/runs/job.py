"""What is known before a servo moves, whatever the motion: what ``execute`` carries out."""

from collections.abc import Callable
from typing import Protocol

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.app.runs.prepare import Prepared
from snakewalk.controller.app.runs.prepare_playback import PreparedPlayback
from snakewalk.controller.app.runs.prepared_gait import PreparedGait
from snakewalk.controller.runlog.record import Laid, PlanSummary
from snakewalk.controller.runtime.guide import Guide

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
