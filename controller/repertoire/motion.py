"""A sequence of recorded actions as joint goals: the repertoire on the bus."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.motion.stop_profile import StopProfile
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.segment import Segment

Choose = Callable[[BodyView], int | None]
"""Function that gets the place of the body at the end of a cycle; it returns the next action, or
None to come to rest."""


class SegmentCycle:
    """The joint goals of one segment, over and over; a brake's once, then it holds its end."""

    done = False

    def __init__(self, segment: Segment, robot: RobotConfig) -> None:
        self._plays_once = segment.kind == "brake"
        end = segment.goal_rad[-1:] if self._plays_once else segment.goal_rad[:1]
        goals = np.concatenate([segment.goal_rad, end])
        time_s = segment.frame_s * np.arange(len(goals))
        if self._plays_once:
            self._spline = CubicSpline(time_s, goals, bc_type=("not-a-knot", "clamped"))
        else:
            self._spline = CubicSpline(time_s, goals, bc_type="periodic")
        self.duration_s = segment.duration_s
        fine = np.linspace(0.0, self.duration_s, 4 * len(goals))
        self._pace = Pace(
            np.abs(self._spline(fine, 1)).max(axis=0), np.abs(self._spline(fine, 2)).max(axis=0)
        )
        self.needs = Needs(
            yaw=bool(np.any(segment.goal_rad[:, robot.yaw_joints])),
            pitch=bool(np.any(segment.goal_rad[:, robot.pitch_joints])),
            wheels=True,
        )
        self.gone_s = 0.0
        """Time since the beginning of the motion, over all cycles."""

    @property
    def cycles(self) -> float:
        """Time of the segment so far."""
        return self.gone_s / self.duration_s

    @property
    def _at_s(self) -> float:
        if self._plays_once:
            return min(self.gone_s, self.duration_s)
        return self.gone_s % self.duration_s

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return np.asarray(self._spline(self._at_s), dtype=float)

    def velocity_rad_s(self) -> Floats:
        """(J,) present speeds of the goals."""
        return np.asarray(self._spline(self._at_s, 1), dtype=float)

    def pace(self) -> Pace:
        """Largest over a cycle."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s``."""
        self.gone_s += dt_s
        return self.goal_rad()


class RepertoireMotion(MotionWrapper):
    """Asks for an action whenever a cycle ends; changes are joined C1 within the limits."""

    def __init__(
        self, repertoire: Repertoire, robot: RobotConfig, first: int, choose: Choose
    ) -> None:
        """Begin with action ``first`` at rest.

        Raises:
            InputError: the robot has other joints.

        """
        repertoire.check(robot)
        self._repertoire = repertoire
        self._robot = robot
        self._choose = choose
        self.action = first
        self._cycle = SegmentCycle(repertoire.segments[first], robot)
        self._switch = SourceSwitch(robot, self._cycle)
        super().__init__(self._switch)
        self._ends = 1
        self._stop_profile = StopProfile()

    @property
    def done(self) -> bool:
        """Whether the motion has come to rest."""
        return self._stop_profile.over

    @property
    def stopping(self) -> bool:
        """Whether the motion is coming to rest, or rests."""
        return self._stop_profile.begun

    def stop(self) -> None:
        """Come to rest along a ``StopProfile``."""
        self._stop_profile.stop()

    def velocity_rad_s(self) -> Floats:
        """(J,) present speeds of the goals."""
        return self._stop_profile.rate * self._switch.velocity_rad_s()

    def pace(self) -> Pace:
        """The robot's limits: actions follow each other."""
        return Pace.limit(self._robot)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        if not self._stop_profile.begun and self._cycle.cycles >= self._ends - 1e-6:
            self._next(view)
        return self._switch.step(self._stop_profile.step(dt_s), view)

    def _next(self, view: BodyView) -> None:
        chosen = self._choose(view)
        if chosen is None:
            self.stop()
        elif chosen == self.action:
            self._ends += 1
        else:
            self.action = chosen
            self._ends = 1
            self._cycle = SegmentCycle(self._repertoire.segments[chosen], self._robot)
            self._switch.join(self._cycle)
