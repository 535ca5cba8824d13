"""Recorded joint angles as a motion: splined, and slowed as far as the robot needs."""

import numpy as np
from scipy.interpolate import CubicSpline

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import HEADROOM, Pace


class Recorded:
    """Plays (T, J) joint angles once, from rest to rest."""

    def __init__(self, robot: RobotConfig, time_s: Floats, joint_rad: Floats) -> None:
        """Spline ``joint_rad`` (T, J) over ``time_s`` (T,), T at least 2.

        Raises:
            InputError: times that do not grow, another number of joints, or joints bent too far.

        """
        if joint_rad.shape != (len(time_s), robot.joint_count) or len(time_s) < 2:
            raise InputError(
                f"a recording of shape {joint_rad.shape} at {len(time_s)} times; "
                f"robot {robot.name} has {robot.joint_count} joints, and two times are the least"
            )
        if not (np.diff(time_s) > 0.0).all():
            raise InputError("the times of a recording must grow")
        self._spline = CubicSpline(time_s, joint_rad, bc_type="clamped")
        fine = np.linspace(time_s[0], time_s[-1], 8 * len(time_s))
        reach, limit = np.abs(self._spline(fine)).max(axis=0), np.array(robot.limit_rad)
        for joint in np.flatnonzero(reach > limit)[:1]:
            raise InputError(
                f"recording: {robot.joint_name(joint)} bends to {reach[joint]:.2f} rad; "
                f"its limit is {limit[joint]:.2f}"
            )
        speed = np.abs(self._spline(fine, 1)).max(axis=0)
        bend = np.abs(self._spline(np.concatenate([fine, time_s]), 2)).max(axis=0)
        fast = float(speed.max()) / (HEADROOM * robot.joint_speed_limit_rad_s)
        hard = float(bend.max()) / (HEADROOM * robot.joint_acceleration_limit_rad_s2)
        self.slowed = max(1.0, fast, float(np.sqrt(hard)))
        """How many times longer it takes here than it took."""
        self._pace = Pace(speed / self.slowed, bend / self.slowed**2)
        self._at_s, self._end_s = float(time_s[0]), float(time_s[-1])
        self.needs = Needs(
            yaw=bool(np.any(joint_rad[:, robot.yaw_joints])),
            pitch=bool(np.any(joint_rad[:, robot.pitch_joints])),
        )

    @property
    def done(self) -> bool:
        """Whether it has been played."""
        return self._at_s >= self._end_s

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return np.asarray(self._spline(self._at_s), dtype=float)

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return np.asarray(self._spline(self._at_s, 1) / self.slowed, dtype=float)

    def pace(self) -> Pace:
        """Largest of the whole recording."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Play on by ``dt_s``; at the end it stays."""
        self._at_s = min(self._at_s + dt_s / self.slowed, self._end_s)
        return self.goal_rad()
