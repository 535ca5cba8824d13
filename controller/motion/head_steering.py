"""Head steering: the neck compensates the body's motion, so that the head keeps its direction."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.rate_limiter import RateLimiter
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.motion.wrapper import MotionWrapper

LEAD_S = 0.12
"""Time by which the swing of the body is predicted: the lag of the servos and of the rate
limiter."""
RANGE_SHARE = 0.9
"""Share of the neck joints' range that is used."""


@dataclass(frozen=True, slots=True)
class HeadTarget:
    """Direction of the head: a heading in the world, or towards a point."""

    heading_rad: float | None = None
    point_m: tuple[float, float] | None = None

    def heading_from(self, head_m: Floats) -> float:
        """Heading for a head at (2,) or (3,)."""
        if self.point_m is not None:
            x, y = self.point_m
            return float(np.arctan2(y - head_m[1], x - head_m[0]))
        return 0.0 if self.heading_rad is None else self.heading_rad


class HeadSteering(MotionWrapper):
    """Another source whose first yaw joints, the neck, are controlled here."""

    def __init__(
        self, source: MotionSource, robot: RobotConfig, target: HeadTarget, neck_joints: int = 2
    ) -> None:
        """Control the first ``neck_joints`` yaw joints of ``source``.

        Raises:
            InputError: the robot has no yaw joint, or lacks joints that the source needs.

        """
        super().__init__(source)
        self.needs.check(robot, "head steering")
        self.source = source
        self.target = target
        self._neck = np.array(robot.yaw_joints[:neck_joints])
        self._robot = robot
        limit_rad = np.array(robot.limit_rad)[self._neck]
        self._reach = RANGE_SHARE * limit_rad
        self._limiter = RateLimiter(
            source.goal_rad()[self._neck],
            robot.joint_speed_limit_rad_s,
            robot.joint_acceleration_limit_rad_s2,
        )
        self._last_rad: float | None = None
        self._swing_rad_s = 0.0

    @property
    def needs(self) -> Needs:
        """Needs of the source, and yaw joints."""
        needs = self.wrapped.needs
        return Needs(yaw=True, pitch=needs.pitch, wheels=needs.wheels)

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self._with_neck(self.source.goal_rad(), self._limiter.angle_rad)

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        return self._with_neck(self.source.velocity_rad_s(), self._limiter.speed_rad_s)

    def pace(self) -> Pace:
        """The source's pace, and the robot's limits in the neck."""
        pace = self.source.pace()
        limit = Pace.limit(self._robot)
        return Pace(
            self._with_neck(pace.speed_rad_s, limit.speed_rad_s[self._neck]),
            self._with_neck(pace.acceleration_rad_s2, limit.acceleration_rad_s2[self._neck]),
        )

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s``; the neck compensates the heading of the link behind it."""
        goal = self.source.step(dt_s, view)
        shoulders = float(view.headings_rad[self._neck[-1] + 1])
        if self._last_rad is not None and dt_s > 0.0:
            turn = float(wrap(shoulders - self._last_rad))
            share = min(1.0, dt_s / 0.06)
            self._swing_rad_s += share * (turn / dt_s - self._swing_rad_s)
        self._last_rad = shoulders
        heading = float(wrap(self.target.heading_from(view.link_m[0]) - shoulders))
        angle_rad = (heading - LEAD_S * self._swing_rad_s) / len(self._neck)
        angles = self._limiter.step(dt_s, np.clip(angle_rad, -self._reach, self._reach))
        return self._with_neck(goal, angles)

    def _with_neck(self, joints: Floats, neck: Floats) -> Floats:
        together = np.array(joints, dtype=float)
        together[self._neck] = neck
        return together
