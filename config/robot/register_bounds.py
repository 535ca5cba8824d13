"""Bounds of a robot's keys: the registers of its servos hold no other values."""

import math

from snakewalk.config.robot.joint_values import JointValues
from snakewalk.config.servo_model import RegisterRow, ServoModel

_GAINS = {
    "position_p_gain": ("Position P Gain", "position_p_gains"),
    "position_i_gain": ("Position I Gain", "position_i_gains"),
    "position_d_gain": ("Position D Gain", "position_d_gains"),
}
"""Gain keys, their registers, and the properties with the value of each joint."""


def initial_gains(robot: JointValues) -> dict[str, int]:
    """Return gains of `[servo]` whose default a register of the model cannot hold.

    The value is the initial one of the register. Keys that the file gives are left out.
    """
    facts = robot.records_by_model.get(robot.servo.model)
    if facts is None:
        return {}
    gains = {}
    for key, name in (
        *((key, register) for key, (register, _) in _GAINS.items()),
        ("pitch_p_gain", "Position P Gain"),
    ):
        if key in robot.servo.model_fields_set:
            continue
        row = _row_without(facts, name, getattr(robot.servo, key))
        if row is not None:
            gains[key] = row.initial
    return gains


def initial_joint_gains(robot: JointValues) -> dict[int, dict[str, int]]:
    """Return gains of single joints that a register of their servo model cannot hold, by joint."""
    gains_by_joint: dict[int, dict[str, int]] = {}
    for joint, (joint_config, facts) in enumerate(
        zip(robot.joints, robot.servo_records, strict=False)
    ):
        if facts.model == robot.servo.model:
            continue
        for key, (register, values) in _GAINS.items():
            is_soft = key == "position_p_gain" and robot.all_axes[joint] == "p"
            given = "pitch_p_gain" if is_soft else key
            if getattr(joint_config, key) is not None or given in robot.servo.model_fields_set:
                continue
            row = _row_without(facts, register, getattr(robot, values)[joint])
            if row is not None:
                gains_by_joint.setdefault(joint, {})[key] = row.initial
    return gains_by_joint


def register_faults(robot: JointValues) -> list[str]:
    """Return gains and currents that a register cannot hold, in words, each once."""
    faults: dict[str, None] = {}
    for joint, facts in enumerate(robot.servo_records):
        for key, (register, values) in _GAINS.items():
            value = getattr(robot, values)[joint]
            fault = _fault(facts, register, value, f"{value}")
            if fault is not None:
                faults[f"{_key(robot, joint, key)} = {fault}"] = None
        limit_a, unit_a = robot.current_limits_a[joint], facts.units.current_a
        if math.isfinite(limit_a) and unit_a and facts.measures_current:
            fault = _fault(
                facts, "Goal Current", round(limit_a / unit_a), f"{limit_a:g} A", unit_a, " A"
            )
            if fault is not None:
                faults[f"{_key(robot, joint, 'current_limit_a')} = {fault}"] = None
    return list(faults)


def half_range_rad(facts: ServoModel) -> float:
    """Return the largest angle on both sides of a servo's zero that its position limits hold."""
    most_rad = math.pi - facts.rad_per_position
    row = facts.registers.get("Max Position Limit")
    if row is None or row.range is None:
        return most_rad
    zero = facts.units.zero_position
    return min(most_rad, min(zero - row.range[0], row.range[1] - zero) * facts.rad_per_position)


def _row_without(facts: ServoModel, name: str, value: int) -> RegisterRow | None:
    """Return the register if its range is known and does not contain the value."""
    row = facts.registers.get(name)
    if row is None or row.range is None or row.range[0] <= value <= row.range[1]:
        return None
    return row


def _fault(
    facts: ServoModel, name: str, value: int, shown: str, unit: float = 1.0, unit_name: str = ""
) -> str | None:
    row = _row_without(facts, name, value)
    if row is None or row.range is None:
        return None
    low, high = max(row.range[0], 0) * unit, row.range[1] * unit
    return (
        f"{shown}: {name}({row.address}) of {facts.model} holds {low:g} to {high:g}{unit_name}; "
        "choose a value in this range"
    )


def _key(robot: JointValues, joint: int, key: str) -> str:
    if robot.joints and getattr(robot.joints[joint], key) is not None:
        return f"joints: {robot.joint_label(joint)}: {key}"
    pitch = robot.all_axes[joint] == "p"
    usual = {"position_p_gain": "pitch_p_gain" if pitch else key}
    usual["current_limit_a"] = "pitch_current_limit_a"
    return f"servo: {usual.get(key, key)}"
