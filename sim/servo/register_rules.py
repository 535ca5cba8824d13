"""What the e-manual says of each register beside its address: access, initial value, range.

Addresses and sizes come from the SDK's own control tables (``drivers.protocol.control_table``); the
columns "Access", "Initial Value" and "Range" are only in the e-manual's control table of each
model: what the whole X series shares stands here, what differs in ``sim.servo.models``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from snakewalk.drivers.protocol.control_table import ControlTable, Register, load_control_table
from snakewalk.drivers.protocol.registers import bauds_of
from snakewalk.sim.servo.models import facts_of


@dataclass(frozen=True, slots=True)
class Rule:
    """Initial value and range; without a range the register is read-only."""

    initial: int
    low: int | None = None
    high: int | None = None

    @property
    def writable(self) -> bool:
        """Access column: RW."""
        return self.low is not None


EXTENDED_RANGE_TICKS = 1_048_575
"""Goal Position(116) in the multi-turn modes: -256 to 256 revolutions."""
PROFILE = ("Profile Acceleration", "Profile Velocity")
GOALS = ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")
MODE_RESETS = (
    *("Velocity I Gain", "Velocity P Gain", "Position D Gain", "Position I Gain"),
    *("Position P Gain", "Feedforward 2nd Gain", "Feedforward 1st Gain"),
    *PROFILE,
)
_GAIN = (0, 16_383)

# e-manual, X series, "Control Table of EEPROM Area" and "Control Table of RAM Area".
_X_SERIES: Mapping[str, Rule] = {
    "Model Number": Rule(0),
    "Model Information": Rule(0),
    "Firmware Version": Rule(48),  # fast sync read needs 45 or later
    "ID": Rule(1, 0, 252),
    "Baud Rate": Rule(1, 0, 7),
    "Return Delay Time": Rule(250, 0, 254),
    "Drive Mode": Rule(0, 0, 13),
    "Operating Mode": Rule(3, 0, 16),
    "Secondary(Shadow) ID": Rule(255, 0, 255),
    "Protocol Type": Rule(2, 1, 22),
    "Homing Offset": Rule(0, -1_044_479, 1_044_479),
    "Moving Threshold": Rule(10, 0, 1_023),
    "Temperature Limit": Rule(80, 0, 100),
    "Max Voltage Limit": Rule(160, 95, 160),
    "Min Voltage Limit": Rule(95, 95, 160),
    "PWM Limit": Rule(885, 0, 885),
    "Current Limit": Rule(1_193, 0, 1_193),
    "Velocity Limit": Rule(350, 0, 1_023),
    "Max Position Limit": Rule(4_095, 0, 4_095),
    "Min Position Limit": Rule(0, 0, 4_095),
    "Startup Configuration": Rule(0, 0, 3),
    "Shutdown": Rule(52, 0, 255),
    "Torque Enable": Rule(0, 0, 1),
    "LED": Rule(0, 0, 1),
    "Status Return Level": Rule(2, 0, 2),
    "Registered Instruction": Rule(0),
    "Hardware Error Status": Rule(0),
    "Velocity I Gain": Rule(1_920, *_GAIN),
    "Velocity P Gain": Rule(100, *_GAIN),
    "Position D Gain": Rule(0, *_GAIN),
    "Position I Gain": Rule(0, *_GAIN),
    "Position P Gain": Rule(800, *_GAIN),
    "Feedforward 2nd Gain": Rule(0, *_GAIN),
    "Feedforward 1st Gain": Rule(0, *_GAIN),
    "Bus Watchdog": Rule(0, 0, 127),
    "Goal PWM": Rule(885, -885, 885),
    "Goal Current": Rule(1_193, -1_193, 1_193),
    "Goal Velocity": Rule(350, -1_023, 1_023),
    "Profile Acceleration": Rule(0, 0, 32_767),
    "Profile Velocity": Rule(0, 0, 32_767),
    "Goal Position": Rule(0, -EXTENDED_RANGE_TICKS, EXTENDED_RANGE_TICKS),
    "Realtime Tick": Rule(0),
    "Moving": Rule(0),
    "Moving Status": Rule(0),
    "Present PWM": Rule(0),
    "Present Current": Rule(0),
    "Present Load": Rule(0),
    "Present Velocity": Rule(0),
    "Present Position": Rule(0),
    "Velocity Trajectory": Rule(0),
    "Position Trajectory": Rule(0),
    "Present Input Voltage": Rule(0),
    "Present Temperature": Rule(0),
    "Backup Ready": Rule(0),
    **dict.fromkeys((f"External Port Mode {n}" for n in (1, 2, 3)), Rule(3, 0, 3)),
    **dict.fromkeys((f"External Port Data {n}" for n in (1, 2, 3)), Rule(0, 0, 4_095)),
}
_BACKUP_READY = Register("Backup Ready", 147, 1, signed=False)
"""In the e-manual's tables from firmware 45 (330: 46) on, but not in the SDK's."""
INDIRECT_FROM = 64
"""What Indirect Address registers may point at: the RAM area."""


@dataclass(frozen=True, slots=True)
class IndirectBlock:
    """Consecutive Indirect Address registers and the data bytes that they give a meaning to."""

    addresses: int
    data: int
    count: int


@dataclass(frozen=True, slots=True)
class ModelRegisters:
    """All registers of one model and their rules, by the SDK's names."""

    layout: ControlTable
    registers: Mapping[str, Register]
    """With the indirect ones numbered, and those that the SDK's table lacks."""
    rules: Mapping[str, Rule]
    indirect: tuple[IndirectBlock, ...]

    @property
    def measures_current(self) -> bool:
        """Whether the servo has a current sensor; without one it shows a load."""
        return "Present Current" in self.rules

    @property
    def bauds(self) -> tuple[int, ...]:
        """Baud rates, by value of the register."""
        return bauds_of(self.layout.model)


@cache
def registers_of(model: str) -> ModelRegisters:
    """Registers and rules of a model.

    Raises:
        ControlTableError: the model cannot be simulated.

    """
    shared = _rules(model)
    layout = load_control_table(model)
    listed = {name: layout[name] for name in layout if name in shared}
    listed[_BACKUP_READY.name] = _BACKUP_READY
    rules = {name: shared[name] for name in listed}
    blocks, first = indirect_blocks(layout), 1
    last = max(block.data + block.count for block in blocks) - 1  # 661; 251 on the 330 models
    for block in blocks:
        for k in range(block.count):
            address, data = f"Indirect Address {first + k}", f"Indirect Data {first + k}"
            listed[address] = Register(address, block.addresses + 2 * k, 2, signed=False)
            listed[data] = Register(data, block.data + k, 1, signed=False)
            rules[address] = Rule(block.data + k, INDIRECT_FROM, last)
            rules[data] = Rule(0, 0, 255)
        first += block.count
    return ModelRegisters(layout, listed, rules, blocks)


def indirect_blocks(layout: ControlTable) -> tuple[IndirectBlock, ...]:
    """Where a model's indirect registers lie: two blocks of 28, on the 330 models one."""
    first, data = layout["Indirect Address 1"].address, layout["Indirect Data 1"].address
    near = IndirectBlock(first, data, (data - first) // 2)
    small = facts_of(layout.model).pwm_slope is not None
    return (near,) if small else (near, IndirectBlock(578, 634, 28))


def _rules(model: str) -> dict[str, Rule]:
    """Register rules of a model by the SDK's register names."""
    facts = facts_of(model)
    low, high = facts.volts
    gains = facts.gains
    own = {
        "Model Number": Rule(load_control_table(model).model_number),
        "Baud Rate": Rule(1, 0, len(bauds_of(model)) - 1),
        "Moving Threshold": Rule(facts.moving_threshold, 0, 1_023),
        "Temperature Limit": Rule(facts.temperature_limit_c, 0, 100),
        "Max Voltage Limit": Rule(high, low, high),
        "Min Voltage Limit": Rule(facts.min_volts or low, low, high),
        "Velocity Limit": Rule(facts.velocity_limit, 0, facts.velocity_range),
        "Shutdown": Rule(facts.shutdown, 0, 255),
        "Velocity I Gain": Rule(gains.velocity_i, *_GAIN),
        "Velocity P Gain": Rule(gains.velocity_p, *_GAIN),
        "Position D Gain": Rule(gains.position_d, *_GAIN),
        "Position I Gain": Rule(gains.position_i, *_GAIN),
        "Position P Gain": Rule(gains.position_p, *_GAIN),
        "Goal Velocity": Rule(facts.velocity_limit, -facts.velocity_range, facts.velocity_range),
    }
    if facts.current_limit is not None:
        limit = facts.current_limit
        own["Current Limit"] = Rule(limit, 0, limit)
        own["Goal Current"] = Rule(limit, -limit, limit)
    if facts.pwm_slope is not None:
        own["PWM Slope"] = Rule(facts.pwm_slope, 1, 255)
    return {**_X_SERIES, **own}
