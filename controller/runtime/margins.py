"""Whether a plan stays within what the robot's joints may be asked, before torque is enabled."""

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.runtime.forecast import Forecast

_HEADROOM = 1.05
"""A piece that is appended may ask for a brake that is a little late."""
_ROUNDING = 1e-9


def margin_faults(plan: Forecast, robot: RobotConfig) -> list[str]:
    """One line per joint and limit that ``plan`` breaks: reach, speed, acceleration, torque."""
    joints = robot.joint_count
    checks = (
        ("bend to", "rad", np.abs(plan.joint_rad).max(axis=0), np.array(robot.limit_rad), 1.0),
        (
            "turn at",
            "rad/s",
            plan.joint_speed_rad_s,
            np.full(joints, robot.joint_speed_limit_rad_s),
            _HEADROOM,
        ),
        (
            "accelerate at",
            "rad/s^2",
            plan.joint_acceleration_rad_s2,
            np.full(joints, robot.joint_acceleration_limit_rad_s2),
            _HEADROOM,
        ),
        ("hold", "N m", plan.joint_torque_n_m, np.full(joints, robot.torque_limit_n_m), 1.0),
    )
    return [
        f"plan: joint {j + 1} would {verb} {asked[j]:.2f} {unit}; its limit is {limit[j]:.2f}"
        for verb, unit, asked, limit, headroom in checks
        for j in np.flatnonzero(asked > headroom * limit + _ROUNDING)
    ]
