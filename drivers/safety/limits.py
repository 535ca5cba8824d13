"""Limits of commands to the servos of one robot in one run."""

import math
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.safety.chain_load import motor_columns
from snakewalk.drivers.types import LIMIT_SLACK_RAD

STEP_SLACK_RAD = 0.2
STALE_MAX_S = 0.25
"""Largest limit of the age that a start chooses itself (ours): 40 ms of latency each way need 0.24,
and 20 degrees are the way of a joint in this time at 1.4 rad/s."""
STEP_RATE = 2.0
"""Slack of a measured step, and its speed as a share of the goals' rate (ours): 0.36 rad in 20 ms;
a link that falls off an edge was measured at 0.12."""
_LEAST_LIMIT_A = 0.05
"""A tenth of a lower limit of the current is lost in the sensor's resolution (ours)."""
EFFORT_SHARE = 0.5
"""Share of the pitch joints' current (ours); held off by the ground they were measured at over
0.8."""


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """Limits of one robot, inclusive."""

    joint_names: tuple[str, ...]
    """J names for messages: ``joint yaw_05 (ID 5)``."""
    limit_rad: Floats
    """(J,) half range of the goals."""
    limit_slack_rad: float
    """Largest measured angle of a joint beyond its limit, bent by force or by overshoot."""
    goal_rate_rad_s: float
    goal_lead_rad: float
    """Largest lead of a goal: goal minus measured angle."""
    current_limit_a: float
    current_time_s: float
    """Longest time for which the current may exceed its limit."""
    temperature_limit_c: float
    voltage_min_v: float
    voltage_max_v: float
    voltage_time_s: float
    """Longest time for which the supply may be too low."""
    stale_limit_s: float
    """Largest age of a position, velocity or current."""
    slow_stale_limit_s: float
    """Largest age of temperature and voltage."""
    following_limit_rad: Floats
    """(J,) how far a joint may be from its goal."""
    following_effort_a: Floats
    """(J,) a joint that pushes towards its goal with this current is held off; infinite where the
    current is not limited."""
    following_time_s: float
    """Longest time for which a joint may not follow its goals."""
    output: Floats | None = None
    """(3, J) output of each joint's motor: share of full output for each radian of error; current
    at full output and at rest, A; limit of the current, A. None: no joint is judged by it."""
    stale_limit_max_s: float = 0.0
    """Limit to which slow replies raise ``stale_limit_s``; 0 if the run's file sets it."""
    step_slack_rad: float = STEP_SLACK_RAD
    motor: Floats | None = None
    """(5, J) as ``chain_load.motor_columns``; None: load and windings are not estimated."""
    fuse_a: float = math.inf
    """Greatest lasting current of the whole chain."""
    winding_limit_c: float = math.inf
    step_rate_rad_s: float = math.inf
    """Largest change of a measured angle: slack, and an angle for each second."""

    @staticmethod
    def from_config(robot: RobotConfig, safety: SafetyConfig) -> "SafetyLimits":
        """Limits from the robot's and the run's configuration."""
        voltage_min_v, voltage_max_v = safety.voltage_limits_v(robot.servo)
        return SafetyLimits(
            joint_names=tuple(map(robot.joint_label, range(robot.joint_count))),
            limit_rad=np.array(robot.limit_rad),
            limit_slack_rad=LIMIT_SLACK_RAD,
            goal_rate_rad_s=safety.goal_rate_rad_s,
            goal_lead_rad=safety.goal_lead_rad,
            current_limit_a=safety.current_limit_of_a(robot),
            current_time_s=safety.current_time_s,
            temperature_limit_c=safety.temperature_limit_c,
            voltage_min_v=voltage_min_v,
            voltage_max_v=voltage_max_v,
            voltage_time_s=safety.voltage_time_s,
            stale_limit_s=safety.stale_limit_s,
            slow_stale_limit_s=safety.slow_stale_limit_s,
            following_limit_rad=np.array(safety.following_limits_rad(robot)),
            following_effort_a=EFFORT_SHARE * np.array(robot.current_limits_a),
            following_time_s=safety.following_time_s,
            output=_output(robot),
            stale_limit_max_s=0.0 if "stale_limit_s" in safety.model_fields_set else STALE_MAX_S,
            motor=motor_columns(robot),
            fuse_a=_fuse_a(robot),
            winding_limit_c=safety.winding_limit_c,
            step_rate_rad_s=STEP_RATE * safety.goal_rate_rad_s,
        )


def _fuse_a(robot: RobotConfig) -> float:
    power = robot.power
    return math.inf if power is None or power.fuse_a is None else power.fuse_a


def _output(robot: RobotConfig) -> Floats:
    """``SafetyLimits.output``; the first row is 0 for a joint that cannot be judged."""
    rows = []
    joints = zip(robot.servo_records, robot.position_p_gains, robot.current_limits_a, strict=True)
    for facts, gain, limit_a in joints:
        stall_a = facts.stall_current_a or 0.0
        is_judged = stall_a > 0.0 and limit_a >= _LEAST_LIMIT_A
        rows.append((gain / facts.full_output_rad if is_judged else 0.0, stall_a, limit_a))
    return np.array(rows).T.copy()
