"""Registers, and their values, that affect the motion or the safety of a chain."""

from collections.abc import Mapping
from dataclasses import dataclass

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.protocol import feetech
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    POSITION_MODE,
    SHUTDOWN_ALARMS,
    TIME_PROFILE,
    TORQUE_ON_BY_GOAL,
    WATCHDOG,
)

JOINT_NUMBER = "Velocity I Gain"
"""Register that stores the joint number: in RAM, unused by position control, reset by a change of
mode."""
STARTUP = "Startup Configuration"
"""Name of a register that firmware before 45 lacks."""
FEETECH_SETTINGS = ("Lock", "Secondary ID", "Acceleration", "Goal Velocity", "Kp", "Kd", "Ki")
"""Registers that only a chain of Feetech servos sets."""


@dataclass(frozen=True, slots=True)
class ChainSetting:
    """A register that affects the motion or the safety of a chain, and its value."""

    register: str
    value: int
    bits: int = -1
    """Mask of the bits that matter; the others stay as they are."""
    usual: bool = True
    """Whether other values come from a factory or another robot; else a change is reported."""

    def value_in(self, registers: Mapping[str, int]) -> int:
        """Register value to write, with the bits outside the mask from ``registers``."""
        return registers[self.register] & ~self.bits | self.value & self.bits


def chain_settings(
    robot: RobotConfig, units: JointUnits, joint: int, goal_pwm: int
) -> tuple[ChainSetting, ...]:
    """Settings of one joint's servo, in the order of writing.

    ``goal_pwm`` is the servo's PWM Limit(36).
    """
    pitch = robot.all_axes[joint] == "p"
    if pitch and not units.limits_current[joint]:  # such a model is soft only with a small output
        goal_pwm = units.pwm_raw(joint, robot.current_limits_a[joint], goal_pwm)
    if robot.servo_records[joint].is_feetech:
        return _feetech_settings(robot, units, joint, goal_pwm)
    mode = CURRENT_POSITION_MODE if units.current_mode[joint] else POSITION_MODE
    return (
        ChainSetting("Return Delay Time", 0),
        # first: a new mode resets the gains
        ChainSetting("Operating Mode", mode),
        # torque switched on by a goal or at power-up would have no watchdog
        ChainSetting("Drive Mode", 0, TIME_PROFILE | TORQUE_ON_BY_GOAL, usual=False),
        ChainSetting(STARTUP, 0, usual=False),
        ChainSetting("Shutdown", SHUTDOWN_ALARMS, SHUTDOWN_ALARMS, usual=False),
        *_limits_and_gains(robot, units, joint),
        ChainSetting("Feedforward 1st Gain", 0, usual=False),
        ChainSetting("Feedforward 2nd Gain", 0, usual=False),
        ChainSetting("Profile Acceleration", 0),
        ChainSetting("Profile Velocity", 0),
        ChainSetting("Goal PWM", goal_pwm, usual=False),
    )


def _limits_and_gains(
    robot: RobotConfig, units: JointUnits, joint: int
) -> tuple[ChainSetting, ...]:
    low, high = units.limits_raw[joint]
    return (
        ChainSetting("Min Position Limit", int(low)),
        ChainSetting("Max Position Limit", int(high)),
        ChainSetting("Position P Gain", robot.position_p_gains[joint]),
        ChainSetting("Position I Gain", robot.position_i_gains[joint]),
        ChainSetting("Position D Gain", robot.position_d_gains[joint]),
    )


def _feetech_settings(
    robot: RobotConfig, units: JointUnits, joint: int, goal_pwm: int
) -> tuple[ChainSetting, ...]:
    """Settings of one joint's Feetech servo, in the order of writing.

    Lock comes first: the servo loses later writes to the EEPROM area at power-off.
    """
    facts = robot.servo_records[joint]
    speed = 1 if facts.motor is None else facts.motor.no_load_rpm / facts.units.velocity_rpm
    shutdown = feetech.shutdown_alarms(facts)
    return (
        ChainSetting("Lock", 1),
        # as its own ID it is without effect
        ChainSetting("Secondary ID", robot.servo_ids[joint], usual=False),
        ChainSetting("Return Delay Time", 0),
        ChainSetting("Operating Mode", feetech.POSITION_MODE),
        ChainSetting("Shutdown", shutdown, shutdown, usual=False),
        *_limits_and_gains(robot, units, joint),
        # HLS servos use copies in the RAM
        ChainSetting("Kp", robot.position_p_gains[joint]),
        ChainSetting("Ki", robot.position_i_gains[joint]),
        ChainSetting("Kd", robot.position_d_gains[joint]),
        ChainSetting("Acceleration", 0),
        # 0 is the highest speed of some servos, and no motion of others (Phase, bit 3)
        ChainSetting("Goal Velocity", round(speed)),
        ChainSetting("Goal PWM", goal_pwm, usual=False),
    )


def limitations(robot: RobotConfig) -> list[str]:
    """Protections that a robot's servos lack, one line per model and reason."""
    lines = [
        f"{facts.model}: measures no current: safety watches its output instead, as a share of the "
        "stall current"
        for facts in robot.records_by_model.values()
        if not facts.measures_current
    ]
    lines += [
        f"{model}: cannot store a joint number: exchanged IDs are not detected; check them by hand"
        for model, facts in robot.records_by_model.items()
        if JOINT_NUMBER not in facts.registers
    ]
    return [*lines, *missing_watchdogs(robot)]


def missing_watchdogs(robot: RobotConfig) -> list[str]:
    """Line on each model without a bus watchdog; it names the joints if others have one."""
    lines = []
    for model, facts in robot.records_by_model.items():
        if WATCHDOG in facts.registers:
            continue
        joints = [
            joint for joint, servo_model in enumerate(robot.servo_models) if servo_model == model
        ]
        which = ""
        if len(joints) < robot.joint_count:
            which = f" ({', '.join(robot.joint_names[joint] for joint in joints)})"
        lines.append(
            f"{model}{which}: has no bus watchdog: it holds its last goal if this program or the "
            "port fails; keep a switch for the servo power at hand"
        )
    return lines
