"""Prepared runs: the interface of every kind of motion, before a servo moves."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import mean_heading_rad
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.controller.terrain.path import SplinePath


class PreparedRun(Protocol):
    """A run that ``run_robot`` can run."""

    @property
    def run(self) -> RunConfig:
        """Configuration of the run."""
        ...

    @property
    def robot(self) -> RobotConfig:
        """Robot with the servo settings of this run."""
        ...

    @property
    def world(self) -> WorldConfig:
        """Ground and friction."""
        ...

    @property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        ...

    @property
    def gain(self) -> float:
        """Predicted speed over pulse speed; NaN without a prediction."""
        ...

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        ...

    def initial_pose(self) -> InitialPose:
        """Return the initial pose of a simulated robot."""
        ...

    def check_plan(self) -> PlanSummary:
        """Check the plan on paper and summarise it for the log.

        Raises:
            InputError: it breaks a limit of the robot.

        """
        ...

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion that reports its decisions to ``on_event``."""
        ...


def start_heading_rad(run: RunConfig) -> float:
    """Start heading of the run, or else the direction of the first waypoint."""
    if run.start_heading_rad is not None:
        return run.start_heading_rad
    x, y = np.subtract(run.waypoints_m[0], run.start_m)
    return float(np.arctan2(y, x))


def pose_with(robot: RobotConfig, heading_rad: float, joint_rad: Floats) -> InitialPose:
    """Return the pose with joint angles (J,) and the mean heading ``heading_rad``."""
    return InitialPose(heading_rad - mean_heading_rad(robot, joint_rad), joint_rad)


def plan_without_path(run: RunConfig) -> PlanSummary:
    """Summarise a plan that stays where it starts."""
    start = np.array([run.start_m, run.start_m], dtype=float)
    return PlanSummary(start, np.zeros((0, 2)), run.waypoint_radius_m)


def plan_of_path(run: RunConfig, path: SplinePath) -> PlanSummary:
    """Summarise a plan along a path."""
    path_m = path.position(np.linspace(0.0, path.length_m, 200))
    return PlanSummary(path_m, np.array(run.waypoints_m), run.waypoint_radius_m)


@dataclass(frozen=True)
class GroundedRun:
    """Base of prepared runs: the configuration and its ground."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig

    @cached_property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        return build_ground(self.world)

    @property
    def ground_ahead(self) -> HeightField | None:
        """Ground that the run knows before it begins; none if it maps the ground."""
        return None if self.run.mapping is not None else self.ground


@dataclass(frozen=True)
class PathlessRun(GroundedRun):
    """Base of prepared runs without a path."""

    @property
    def gain(self) -> float:
        """NaN: without a path no speed is predicted."""
        return float("nan")

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return self.run.start_heading_rad or 0.0


@runtime_checkable
class AsksForPort(Protocol):
    """A prepared run that needs the user's consent before it moves servos on a port."""

    def check_for_port(self) -> None:
        """Ask for it.

        Raises:
            InputError: the question.

        """
        ...


@runtime_checkable
class HasWaypoints(Protocol):
    """A prepared run along waypoints, which a person may change."""

    def path_length_m(self) -> float:
        """Return the length of the path through the waypoints."""
        ...

    def check_waypoint(self, point_m: Floats) -> None:
        """Check that the motion may go to a point (2,).

        Raises:
            InputError: says what is there.

        """
        ...
