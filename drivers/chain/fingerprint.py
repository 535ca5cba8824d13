"""Fingerprint: EEPROM settings of a servo for zero, direction, limits and protection."""

from collections.abc import Mapping

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.protocol.registers import REVERSE

PROTECTION = (
    "PWM Limit",
    "Current Limit",
    "Velocity Limit",
    "Temperature Limit",
    "Min Voltage Limit",
    "Max Voltage Limit",
    "Protection Current",
    "Over-current Time",
    "Overload Torque",
    "Protection Time",
    "Protective Torque",
)
"""Registers that decide when a servo protects itself; the last five are those of Feetech servos."""
FINGERPRINT = (
    "Homing Offset",
    "Drive Mode",
    "Operating Mode",
    "Shutdown",
    "Min Position Limit",
    "Max Position Limit",
    *PROTECTION,
)
"""Registers of it; a model may lack some."""
Fingerprint = Mapping[str, int]
"""Values of these registers of one servo."""


def fingerprint_of(registers: Mapping[str, int]) -> dict[str, int]:
    """The fingerprint among registers of a servo."""
    return {name: registers[name] for name in FINGERPRINT if name in registers}


def register_change(name: str, before: int, now: int, rad_per_position: float) -> str:
    """Text about a register change and its effect on the joint."""
    text = f"{name} is {now}, was {before}"
    if name == "Homing Offset":
        moved_rad = (now - before) * abs(rad_per_position)
        return f"{text}: its zero has moved by {moved_rad:+.2f} rad"
    if name == "Drive Mode" and (now ^ before) & REVERSE:
        return f"{text}: it turns the other way round"
    return text


def fingerprint_faults(
    robot: RobotConfig, joint: int, before: Fingerprint, now: Fingerprint, rad_per_position: float
) -> list[str]:
    """Lines on the changed registers of a joint's servo."""
    name = robot.joint_label(joint)
    return [
        f"{name}: {register_change(register, value, now[register], rad_per_position)}"
        for register, value in before.items()
        if register in now and now[register] != value
    ]
