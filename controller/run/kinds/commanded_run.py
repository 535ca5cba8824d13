"""A run whose joints another program commands."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent

MakeCommanded = Callable[[RobotConfig, OnEvent], MotionSource]
"""Puts whoever commands in charge of a robot."""


@dataclass(frozen=True)
class CommandedRun(PathlessRun):
    """A ``PreparedRun`` of unknown commands: each is checked on arrival."""

    make: MakeCommanded

    def initial_pose(self) -> InitialPose:
        """Return the straight body."""
        straight = np.zeros(self.robot.joint_count)
        return pose_with(self.robot, self.start_heading_rad, straight)

    def check_plan(self) -> PlanSummary:
        """Summarise a plan that stays where it starts."""
        return plan_without_path(self.run)

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion, which holds."""
        return self.make(self.robot, on_event)
