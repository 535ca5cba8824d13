"""A run of a user's motion source, checked on paper before torque."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.motion.path_progress import path_progress
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.run.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.drivers.types import BodyPose

MakeSource = Callable[[RobotConfig], MotionSource]
"""Makes a fresh motion for a robot, for example the class of a source."""
_SLACK = 1.0 + 1e-6
"""Allowed rounding at a limit."""


@dataclass(frozen=True)
class SourceRun(PathlessRun):
    """A ``PreparedRun`` of a user's own motion source."""

    make: MakeSource

    def initial_pose(self) -> InitialPose:
        """Return the shape that the source begins with."""
        goal_rad = _array(self.make(self.robot).goal_rad(), "goal_rad()")
        return pose_with(self.robot, self.start_heading_rad, goal_rad)

    def check_plan(self) -> PlanSummary:
        """Check range, speed and acceleration of every joint over the whole run.

        The source is stepped at the run's rate with the head at rest and the joints on their goals.
        If it reacts to the body it may move otherwise in the run, where the safety link vets every
        command.

        Raises:
            InputError: one line for each fault.

        """
        robot = self.robot
        source = self.make(self.robot)
        if self.make(robot) is source:
            raise InputError("the motion source: return a new motion source at each call")
        source.needs.check(robot, "the motion source")
        period_s = 1.0 / self.run.cycle_hz
        first_rad = self._goal_rad(source.goal_rad(), 0.0, "goal_rad()")
        heading_rad = pose_with(robot, self.start_heading_rad, first_rad).heading_rad
        frame = Frame.flat(*self.run.start_m, heading_rad, robot.body_radius_m)
        head = BodyPose(0.0, frame.origin_m, frame.rotation)
        begun_rad = path_progress(source).begin(body_in_world(robot, head, first_rad))
        goals = [first_rad, self._goal_rad(begun_rad, 0.0, "begin()")]
        _array(source.velocity_rad_s(), "velocity_rad_s()")
        pace = source.pace()
        _array(pace.speed_rad_s, "the speed of pace()")
        _array(pace.acceleration_rad_s2, "the acceleration of pace()")
        for k in range(round(self.run.time_limit_s * self.run.cycle_hz)):
            if source.done:
                break
            view = body_in_world(robot, head, goals[-1])
            goal_rad = source.step(period_s, view)
            goals.append(self._goal_rad(goal_rad, (k + 1) * period_s, "step()"))
        speed = np.diff(goals[1:], axis=0, prepend=goals[1:2]) / period_s
        acceleration = np.diff(speed, axis=0) / period_s
        limit = Pace.limit(robot)
        faults: list[str] = []
        for what, values, most, unit in (
            ("bends to", np.array(goals), np.array(robot.limit_rad), "rad"),
            ("moves at", speed, limit.speed_rad_s, "rad/s"),
            ("accelerates at", acceleration, limit.acceleration_rad_s2, "rad/s2"),
            ("announces", pace.speed_rad_s[None], limit.speed_rad_s, "rad/s"),
            ("announces", pace.acceleration_rad_s2[None], limit.acceleration_rad_s2, "rad/s2"),
        ):
            reach = np.abs(values).max(axis=0, initial=0.0)
            worst = int(np.argmax(reach / most))
            if reach[worst] > most[worst] * _SLACK:
                faults.append(
                    f"the motion source: {self.robot.joint_label(worst)} {what} {reach[worst]:.2f} "
                    f"{unit}; its limit is {most[worst]:.2f}"
                )
        if faults:
            raise InputError(faults)
        return plan_without_path(self.run)

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion."""
        return self.make(self.robot)

    def _goal_rad(self, goal_rad: Floats, time_s: float, call: str) -> Floats:
        goal_rad = _array(goal_rad, call).copy()
        if goal_rad.shape != (self.robot.joint_count,) or not np.isfinite(goal_rad).all():
            raise InputError(
                f"the motion source: at {time_s:.2f} s its goals are {goal_rad}; robot "
                f"{self.robot.name} needs {self.robot.joint_count} finite angles"
            )
        return goal_rad


def _array(values: Floats, call: str) -> Floats:
    """Return values that a compiled loop accepts.

    Raises:
        InputError: they are a list, or an array of another type.

    """
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return values
    is_array = isinstance(values, np.ndarray)
    kind = f"an array of {values.dtype}" if is_array else f"a {type(values).__name__}"
    raise InputError(
        f"the motion source: {call} returns {kind}; return an array of float64: "
        "np.array(values, dtype=float)"
    )
