"""Fingerprint: EEPROM settings of a servo for zero, direction, limits and protection."""

from collections.abc import Iterable, Mapping

from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.protocol.registers import REVERSE

FINGERPRINT = (
    "Homing Offset",
    "Drive Mode",
    "Operating Mode",
    "Shutdown",
    "Min Position Limit",
    "Max Position Limit",
    "PWM Limit",
    "Current Limit",
    "Velocity Limit",
    "Temperature Limit",
    "Min Voltage Limit",
    "Max Voltage Limit",
)
"""First registers of a servo's fingerprint; a model may lack some, and its file marks others."""
COMPARED = ("kept", "usual", "fixed")
"""Marks of the other registers of a fingerprint."""
Fingerprint = Mapping[str, int]
"""Values of the fingerprint registers of one servo."""


def fingerprint_registers(facts: ServoModel) -> list[str]:
    """Names of the registers of a model's fingerprint."""
    return list(dict.fromkeys((*present(FINGERPRINT, facts), *facts.marked(*COMPARED))))


def present(names: Iterable[str], facts: ServoModel) -> list[str]:
    """Names from a list that a model has."""
    return [name for name in names if name in facts.registers]


def fingerprint_of(registers: Mapping[str, int], facts: ServoModel) -> dict[str, int]:
    """The fingerprint among registers of a servo."""
    return {name: registers[name] for name in fingerprint_registers(facts) if name in registers}


def set_register(servo_id: int, name: str, value: int) -> str:
    """Command that sets a register which no run sets."""
    return f"snakewalk bus set --id {servo_id} --register '{name}={value}'"


def fixed_faults(
    servo_id: int, registers: Mapping[str, int], facts: ServoModel
) -> list[tuple[str, str]]:
    """Texts and remedies of registers without the value that the driver's units need."""
    faults = []
    for name in facts.marked("fixed"):
        row = facts.registers[name]
        value = registers.get(name, row.initial)
        if (value ^ row.initial) & row.bits:
            right = value & ~row.bits | row.initial & row.bits
            text = f"{name}({row.address}) is {value}, not {right}: scale or direction of its "
            faults.append((f"{text}positions differs", set_register(servo_id, name, right)))
    return faults


def register_change(name: str, before: int, now: int, rad_per_position: float) -> str:
    """Text about a register change and its effect on the joint."""
    text = f"{name} is {now}, was {before}"
    if name == "Homing Offset":
        moved_rad = (now - before) * abs(rad_per_position)
        return f"{text}: its zero has moved by {moved_rad:+.2f} rad"
    if name == "Drive Mode" and (now ^ before) & REVERSE:
        return f"{text}: its direction is reversed"
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
