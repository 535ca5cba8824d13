"""Prepared runs: the interface of every kind of motion, before a servo moves."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import FlatGround, WaterGround, WorldConfig
from snakewalk.controller.kinematics.links import mean_heading_rad
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner


class PreparedRun(Protocol):
    """A run that ``execute`` can carry out."""

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


def pose_with(robot: RobotConfig, heading_rad: float, joint_rad: Floats) -> InitialPose:
    """Return the pose with joint angles (J,) and the mean heading ``heading_rad``."""
    return InitialPose(heading_rad - mean_heading_rad(robot, joint_rad), joint_rad)


def plan_without_path(run: RunConfig) -> PlanSummary:
    """Summarise a plan that stays where it starts."""
    start = np.array([run.start_m, run.start_m], dtype=float)
    return PlanSummary(start, np.zeros((0, 2)), run.waypoint_radius_m)


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


@dataclass(frozen=True)
class PathRun(GroundedRun):
    """Base of prepared runs along a path that is planned through waypoints."""

    @cached_property
    def planner(self) -> TerrainPlanner:
        """Plans paths over safe ground."""
        return TerrainPlanner(self.ground_ahead, self.world.planner)

    @cached_property
    def path(self) -> SplinePath:
        """Through the start and the waypoints."""
        return self.planner.plan(np.vstack([self.run.start_m, self.run.waypoints_m]))

    def check_waypoint(self, point_m: Floats) -> None:
        """Reject a point (2,) off the ground or in an obstacle; paths are not checked.

        Raises:
            InputError: with the fault.

        """
        x_m, y_m = (float(at) for at in point_m)
        where = f"waypoint ({x_m:.2f}, {y_m:.2f})"
        if not self.on_map(point_m):
            wide_m = self._map_size_m
            raise InputError(
                f"{where} is outside the world, {wide_m[0]:.1f} m by {wide_m[1]:.1f} m"
            )
        obstacle = self.world.obstacle
        if obstacle is not None and obstacle.is_blocked_at(x_m, y_m):
            raise InputError(f"{where} is in the world's obstacle, the {obstacle.kind}")

    def on_map(self, points_m: Floats) -> Bools:
        """Whether points (..., 2) are on the world's ground: (...)."""
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return np.asarray(np.abs(points_m).max(axis=-1) <= 0.5 * ground.size_m)
        assert self.ground is not None
        return self.ground.contains(points_m[..., 0], points_m[..., 1])

    @property
    def _map_size_m(self) -> tuple[float, float]:
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return ground.size_m, ground.size_m
        assert self.ground is not None
        return self.ground.size_m

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        given = self.run.start_heading_rad
        return self.path.heading_rad(0.05) if given is None else given
