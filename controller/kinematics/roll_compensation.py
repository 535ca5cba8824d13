"""Roll compensation: joint goals that bend a rolled body in the intended plane.

A rolled body bends its yaw joints out of the ground's plane. The compensation turns the bends back
by the roll angle: the neighbouring pitch joints supply the missing part. It leaves a remainder, so
that the weight of the tilted shape turns the body back.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.drivers.compiling import compiled

_LEFT_IN_RAD = 1.0
"""Roll that is not compensated: the weight corrects it (ours)."""
_RATE_RAD_S = 2.0
"""Fastest change of the compensation: joints of 0.7 rad then move at 1.4 rad/s (ours)."""


class RollCompensation:
    """Turns joint goals by the roll of the body."""

    def __init__(self, robot: RobotConfig) -> None:
        """``robot`` has both yaw and pitch joints."""
        self._yaw = np.array(robot.yaw_joints, dtype=np.intp)
        self._pitch = np.array(robot.pitch_joints, dtype=np.intp)
        self._limit_rad = np.array(robot.limit_rad)
        self._measured_rad = 0.0
        self._roll_rad = 0.0

    def __call__(self, goal_rad: Floats, view: BodyView, dt_s: float) -> Floats:
        """Return goals (J,) that bend the rolled body as ``goal_rad`` would bend a level one."""
        # unwrapped, so that a body on its back turns in one direction only
        self._measured_rad += float(wrap(body_roll_rad(view) - self._measured_rad))
        turns = 2.0 * np.pi * round(self._measured_rad / (2.0 * np.pi))
        if abs(self._measured_rad - turns) < _LEFT_IN_RAD:  # nearly level: forget whole turns
            self._measured_rad -= turns
            self._roll_rad -= turns
        measured = self._measured_rad
        change_rad = measured - min(max(measured, -_LEFT_IN_RAD), _LEFT_IN_RAD)
        most = _RATE_RAD_S * dt_s
        self._roll_rad += min(max(change_rad - self._roll_rad, -most), most)
        if self._roll_rad == 0.0:
            return goal_rad
        joints = np.arange(len(goal_rad))
        level = np.interp(joints, self._yaw, goal_rad[self._yaw])
        rise = np.interp(joints, self._pitch, goal_rad[self._pitch])
        c, s = np.cos(self._roll_rad), np.sin(self._roll_rad)
        out = np.empty_like(goal_rad)
        out[self._yaw] = (c * level + s * rise)[self._yaw]
        out[self._pitch] = (c * rise - s * level)[self._pitch]
        return np.clip(out, -self._limit_rad, self._limit_rad)


def body_roll_rad(view: BodyView) -> float:
    """Mean roll of the links about their own axes, from -pi to pi; positive with the left up."""
    return _mean_roll_rad(view.rotation)


@compiled("float64(float64[:, :, ::1])", makes_arrays=False)
def _mean_roll_rad(rotation: Floats) -> float:
    """Direction of the sum of the unit vectors to each link's up axis, seen along the link."""
    left_up = up = 0.0
    for k in range(len(rotation)):
        left_z, up_z = rotation[k, 2, 1], rotation[k, 2, 2]
        size = np.hypot(left_z, up_z)
        left_up += left_z / size
        up += up_z / size
    return float(np.arctan2(left_up, up))
