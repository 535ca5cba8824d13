"""Recordings of a servo that swings a weight on an arm, for ``snakewalk robot identify``."""

import math

from snakewalk.config.loader import with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand

SWING_RAD = 1.2
"""Amplitude (ours)."""
SWING_S, FALL_S = 6.0, 2.0
"""Time of the swing, whose last second holds the arm up, and of its fall without torque (ours)."""
_CYCLE_S = 0.01


def record(
    bus: DynamixelBus, like: RobotConfig, servo_id: int, p_gain: int
) -> list[dict[str, float]]:
    """Swing the arm around the angle at which it hangs, then let it fall; return BAM's entries.

    Args:
        bus: of the servo.
        like: robot with servos of this model, for supply and limits.
        servo_id: of the servo.
        p_gain: its Position P Gain.

    Raises:
        DriverError: the servo cannot start, or safety has latched.

    """
    keys = {"name": "pendulum", "joint_axes": "y", "yaw_limit_rad": 3.1, "servo.first_id": servo_id}
    robot = with_keys(like, keys | {"servo.position_p_gain": p_gain}, f"robot {like.name}")
    clock = bus.port.clock
    # a weak servo lags far behind its goal, which shows its constants
    safety = SafetyConfig(goal_rate_rad_s=20.0, goal_lead_rad=4.0, following_limit_rad=3.5)
    limits = SafetyLimits.from_config(robot, safety)
    entries: list[dict[str, float]] = []
    with SafeLink(ServoChain(bus, robot), limits, clock) as link:
        zero_rad = link.enable().position_rad
        begin_s = clock.now_s()
        goal_rad = zero_rad
        for tick in ticks(clock, _CYCLE_S, begin_s + SWING_S + FALL_S):
            time_s = tick.deadline_s - begin_s
            state = link.read()
            is_on = time_s < SWING_S
            if is_on:
                wave = math.sin(2.0 * time_s) * math.cos(5.1 * time_s)
                share = wave if time_s < SWING_S - 1.0 else 1.0
                link.write(JointCommand(clock.now_s(), zero_rad + SWING_RAD * share))
                assert link.last_verdict is not None
                goal_rad = link.last_verdict.goal_rad
            elif entries[-1]["torque_enable"]:
                link.disable()
            entries.append(
                {
                    "timestamp": state.time_s - begin_s,
                    "goal_position": float(goal_rad[0] - zero_rad[0]),
                    "position": float(state.position_rad[0] - zero_rad[0]),
                    "input_volts": float(state.voltage_v[0]),
                    "torque_enable": float(is_on),
                }
            )
    return entries
