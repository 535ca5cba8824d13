"""Registers of a servo of Protocol 1.0, from the file of its model."""

from collections.abc import Mapping

from snakewalk.config.servo_model import RegisterRow, ServoModel

MODEL = "AX-12A"
"""Model that stands for all in messages, and in captures without a model."""


def end_of(registers: Mapping[str, RegisterRow]) -> int:
    """First address after a control table."""
    return max(row.address + row.size for row in registers.values())


def initial_value(facts: ServoModel, name: str) -> int:
    """Value of a register of a new servo."""
    values_by_name = {"Model Number": facts.model_number, "Firmware Version": facts.firmware}
    return values_by_name.get(name, facts.registers[name].initial)
