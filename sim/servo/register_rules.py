"""Rules of each register from the model's file: initial value and range."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from snakewalk.config.servo_catalogue import servo_model, shipped_models
from snakewalk.config.servo_model import MotorRow, ServoModel
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import (
    ControlTable,
    Model,
    Register,
    load_control_table,
)


@dataclass(frozen=True, slots=True)
class Rule:
    """Initial value and range; without a range the register is read-only."""

    initial: int
    low: int | None = None
    high: int | None = None

    @property
    def writable(self) -> bool:
        """Whether the access is RW."""
        return self.low is not None


PROFILE = ("Profile Acceleration", "Profile Velocity")
GOALS = ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")
MODE_RESETS = (
    "Velocity I Gain",
    "Velocity P Gain",
    "Position D Gain",
    "Position I Gain",
    "Position P Gain",
    "Feedforward 2nd Gain",
    "Feedforward 1st Gain",
    *PROFILE,
)


@dataclass(frozen=True, slots=True)
class IndirectBlock:
    """Consecutive Indirect Address registers and their data bytes."""

    addresses: int
    data: int
    count: int


@dataclass(frozen=True, slots=True)
class ModelRegisters:
    """All registers of one model and their rules, by the names of the e-manual."""

    layout: ControlTable
    motor: MotorRow
    registers: Mapping[str, Register]
    """Including the indirect ones, numbered."""
    rules: Mapping[str, Rule]
    indirect: tuple[IndirectBlock, ...]

    @property
    def facts(self) -> ServoModel:
        """Record of the model."""
        return self.layout.facts

    @property
    def measures_current(self) -> bool:
        """Whether the servo has a current sensor; without one it reports a load."""
        return self.facts.measures_current


def limit_of(goal: str) -> str:
    """Register that limits a goal."""
    return goal.removeprefix("Goal ") + " Limit"


def motor_row(facts: ServoModel) -> MotorRow:
    """Motor of a model.

    Raises:
        ControlTableError: its file has no motor, so it cannot be simulated.

    """
    if facts.motor is None:
        names = ", ".join(simulated_models())
        raise ControlTableError(
            f"{facts.model}: its file has no table [motor], so it cannot be simulated; models that "
            f"can are {names}; docs/how-to/add-a-servo-model.md"
        )
    return facts.motor


@cache
def simulated_models() -> tuple[str, ...]:
    """Names of the shipped models of Protocol 2.0 that can be simulated."""
    models = (servo_model(name) for name in shipped_models())
    return tuple(m.model for m in models if m.motor is not None and m.protocol == 2)


def registers_of(model: Model) -> ModelRegisters:
    """Registers and rules of a model.

    Raises:
        ControlTableError: the model cannot be simulated.

    """
    return (
        _named_registers(model) if isinstance(model, str) else _registers(load_control_table(model))
    )


@cache
def _named_registers(model: str) -> ModelRegisters:
    return _registers(load_control_table(model))


def _registers(layout: ControlTable) -> ModelRegisters:
    facts = layout.facts
    motor = motor_row(facts)
    listed = {name: layout[name] for name in facts.registers}
    rules = _rules(facts)
    blocks = tuple(IndirectBlock(*block) for block in facts.indirect)
    first = 1
    last = max((block.data + block.count for block in blocks), default=1) - 1
    for block in blocks:
        for k in range(block.count):
            address = f"Indirect Address {first + k}"
            data = f"Indirect Data {first + k}"
            listed[address] = Register(address, block.addresses + 2 * k, 2, signed=False)
            listed[data] = Register(data, block.data + k, 1, signed=False)
            rules[address] = Rule(block.data + k, facts.ram_from, last)
            rules[data] = Rule(0, 0, 255)
        first += block.count
    return ModelRegisters(layout, motor, listed, rules, blocks)


def _rules(facts: ServoModel) -> dict[str, Rule]:
    """Rules of the file's registers; initial identity and goals come from other facts."""
    initial_values = {"Model Number": facts.model_number, "Firmware Version": facts.firmware}
    for goal in GOALS[:3]:
        if limit_of(goal) in facts.registers:
            initial_values[goal] = facts.registers[limit_of(goal)].initial
    return {
        name: Rule(initial_values.get(name, row.initial), *(row.range or ()))
        for name, row in facts.registers.items()
    }
