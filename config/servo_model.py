"""A servo model: control table, units and motor, one record for host and simulator.

Each model has one file in `config/servos`; a robot may have its own
(docs/how-to/add-a-servo-model.md).
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from snakewalk.config.base import Share, Strict
from snakewalk.config.value_faults import MARK_PATTERN

TABLE_BYTES = 1024
"""Number of addresses that a control table may use."""
MODES = (0, 1, 3, 4, 5, 16)
"""Operating Mode of Protocol 2.0: current, velocity, position, extended position, current-based
position, PWM."""
FEETECH_MODES = (0, 1, 2, 3)
"""Operating Mode of Feetech servos: position, velocity, PWM or current, step or PWM."""
ModelName = Annotated[
    str, StringConstraints(min_length=1, max_length=40, pattern=r"^[A-Z0-9][A-Z0-9.+()-]*$")
]
"""Model as printed on the servo, in capitals: ``XM430-W350``."""
Alarm = Literal["overload", "overheating", "voltage", "encoder", "shock"]
Block = tuple[int, int, int]

_P_GAIN_DIVISOR = 128.0
"""Divisor of the register Position P Gain (e-manual, X series)."""
_FOR_A_RUN = (
    "Model Number",
    "Firmware Version",
    "ID",
    "Baud Rate",
    "Return Delay Time",
    "Drive Mode",
    "Operating Mode",
    "Secondary(Shadow) ID",
    "Homing Offset",
    "PWM Limit",
    "Min Position Limit",
    "Max Position Limit",
    "Shutdown",
    "Torque Enable",
    "Status Return Level",
    "Hardware Error Status",
    "Velocity I Gain",
    "Position D Gain",
    "Position I Gain",
    "Position P Gain",
    "Feedforward 2nd Gain",
    "Feedforward 1st Gain",
    "Bus Watchdog",
    "Goal PWM",
    "Profile Acceleration",
    "Profile Velocity",
    "Goal Position",
    "Present Velocity",
    "Present Position",
    "Present Input Voltage",
    "Present Temperature",
)
"""Registers that a run on a port reads or writes."""
_FOR_THE_SIMULATOR = (
    "Moving Threshold",
    "Temperature Limit",
    "Max Voltage Limit",
    "Min Voltage Limit",
    "Velocity Limit",
    "Registered Instruction",
    "Velocity P Gain",
    "Goal Velocity",
    "Realtime Tick",
    "Moving",
    "Moving Status",
    "Present PWM",
    "Velocity Trajectory",
    "Position Trajectory",
)
"""Registers that the simulated servo needs besides those of a run."""
_OF_PROTOCOL_1 = (
    "Model Number",
    "Firmware Version",
    "ID",
    "Baud Rate",
    "Return Delay Time",
    "CW Angle Limit",
    "CCW Angle Limit",
    "Temperature Limit",
    "Min Voltage Limit",
    "Max Voltage Limit",
    "Max Torque",
    "Status Return Level",
    "Shutdown",
    "Torque Enable",
    "CW Compliance Margin",
    "CCW Compliance Margin",
    "CW Compliance Slope",
    "CCW Compliance Slope",
    "Goal Position",
    "Moving Speed",
    "Torque Limit",
    "Present Position",
    "Present Speed",
    "Present Load",
    "Present Voltage",
    "Present Temperature",
    "Registered",
    "Moving",
    "Lock",
)
"""Registers that a simulated servo of Protocol 1.0 needs."""
_OF_FEETECH = (
    "Firmware Version",
    "Model Number",
    "ID",
    "Baud Rate",
    "Status Return Level",
    "Min Position Limit",
    "Max Position Limit",
    "Temperature Limit",
    "Max Voltage Limit",
    "Min Voltage Limit",
    "PWM Limit",
    "Shutdown",
    "Position P Gain",
    "Torque Enable",
    "Goal Position",
    "Goal Velocity",
    "Lock",
    "Present Position",
    "Present Velocity",
    "Present Load",
    "Present Input Voltage",
    "Present Temperature",
    "Registered Instruction",
    "Hardware Error Status",
    "Moving",
)
"""Registers that a run on a port and the simulated servo need of a Feetech servo."""


class RegisterRow(Strict):
    """Row of a control table."""

    address: int = Field(ge=0, lt=TABLE_BYTES, description="address of the register's first byte")
    size: Literal[1, 2, 4] = Field(description="bytes, in the model's byte order")
    signed: bool = Field(False, description="two's complement")
    sign_bit: int | None = Field(
        None, ge=0, le=15, description="bit of the sign, the bits below it are the magnitude"
    )
    initial: int = Field(0, description="value of a new servo, in RAM after each start")
    range: tuple[int, int] | None = Field(
        None, description="lowest and highest value that a host may write; default: read-only"
    )
    mark: str | None = Field(
        None,
        pattern=MARK_PATTERN,
        description="treatment by a run: set, fixed (another value than `initial` forbids a "
        "start), usual (doctor reports another value), kept, or ignored with a reason; default: "
        "kept in the EEPROM, set in the RAM",
    )
    bits: int = Field(-1, description="mask of the bits that a fixed register compares")

    @model_validator(mode="after")
    def _values_fit(self) -> Self:
        bits = 8 * self.size
        if self.sign_bit is not None and (self.signed or self.sign_bit >= bits):
            raise ValueError(f"sign_bit: {self.sign_bit} does not fit in {self.size} byte(s)")
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if self.signed else (0, (1 << bits) - 1)
        if self.sign_bit is not None:
            high = (1 << self.sign_bit) - 1
            low = -high
        for key, value in (("initial", self.initial), *(("range", v) for v in self.range or ())):
            if not low <= value <= high:
                raise ValueError(f"{key}: {value} does not fit in {self.size} byte(s)")
        if self.range is not None and not self.range[0] <= self.range[1]:
            raise ValueError(f"range: {self.range[0]} is above {self.range[1]}")
        return self


class UnitsRow(Strict):
    """Meaning of the raw values."""

    positions_per_turn: float = Field(
        gt=1.0, description="raw positions in a turn of the output shaft"
    )
    zero_position: int = Field(description="raw position of 0 rad")
    velocity_rpm: float = Field(gt=0.0, description="rev/min of one unit of velocity")
    acceleration_rpm2: float | None = Field(
        None, gt=0.0, description="rev/min^2 of one unit of Profile Acceleration"
    )
    current_a: float | None = Field(
        None, gt=0.0, description="ampere of one unit of current; default: not known"
    )
    full_pwm: int | None = Field(
        None, gt=0, description="Goal PWM, or Torque Limit, of full output; default: not known"
    )
    homing_limit: int | None = Field(
        None, gt=0, description="Homing Offset beyond which position mode ignores it"
    )


class MotorRow(Strict):
    """Motor and gears at the output shaft, at the recommended voltage."""

    nominal_v: float = Field(gt=0.0, le=60.0, description="recommended supply voltage")
    voltage_v: tuple[float, float] = Field(description="lowest and highest supply voltage")
    stall_torque_n_m: float = Field(
        gt=0.0, le=1000.0, description="torque at which the servo does not turn"
    )
    stall_current_a: float = Field(gt=0.0, le=100.0, description="current at the stall torque")
    no_load_rpm: float = Field(
        gt=0.0, le=1000.0, description="speed without load in turns per minute"
    )
    standby_a: float = Field(
        0.04, ge=0.0, le=2.0, description="current of the servo without torque"
    )
    p_gain_divisor: float = Field(
        _P_GAIN_DIVISOR,
        gt=0.0,
        description="Position P Gain over this is the PWM for one position of error",
    )
    winding_k_per_w: float = Field(
        gt=0.0, description="heating of the temperature sensor for each watt of loss"
    )
    thermal_time_s: float = Field(
        gt=0.0, description="time constant of the heating of the temperature sensor"
    )

    @model_validator(mode="after")
    def _voltages_are_in_order(self) -> Self:
        low_v, high_v = self.voltage_v
        if not 0.0 < low_v <= self.nominal_v <= high_v:
            raise ValueError(
                f"voltage_v: [{low_v:g}, {high_v:g}] does not contain nominal_v = "
                f"{self.nominal_v:g}"
            )
        return self


class FrictionRow(Strict):
    """Measured friction and inertia of the gears at the output shaft."""

    armature_kg_m2: float = Field(ge=0.0, le=1.0, description="inertia of rotor and gears")
    dry_n_m: float = Field(0.0, ge=0.0, description="friction without load")
    viscous_n_m_s: float = Field(0.0, ge=0.0, description="friction torque per rad/s of speed")
    stribeck_n_m: float = Field(0.0, ge=0.0, description="additional friction of a slow shaft")
    stribeck_rad_s: float = Field(
        0.3, gt=0.0, description="speed at which the additional friction of a slow shaft has faded"
    )
    by_motor: Share = Field(0.0, description="friction as a share of the motor's torque")
    by_load: Share = Field(0.0, description="friction as a share of the load's torque")
    by_load_slow: Share = Field(
        0.0, description="additional share of the load's torque of a slow shaft"
    )


class ServoModel(Strict):
    """Control table, units and motor of one model."""

    model: ModelName = Field(description="name as printed on the servo, in capitals")
    model_number: int = Field(ge=0, le=0xFFFF, description="model number (register 0)")
    like: str | None = Field(
        None,
        description="name or file of a model whose keys and registers this file "
        "adopts if it does not set them, except source and [friction]",
    )
    without: tuple[str, ...] = Field(
        (), description="registers of the model `like` that this model lacks"
    )
    protocol: Literal[1, 2, "feetech"] = Field(
        2, description='protocol of the servo: DYNAMIXEL 1.0 or 2.0, or "feetech"'
    )
    byte_order: Literal["little", "big"] = Field(
        "little", description="byte order of registers of 2 bytes"
    )
    sync_read: bool = Field(True, description="whether a Feetech servo has sync read")
    source: str = Field(
        min_length=1, description="documents with these figures; mark your own with (ours)"
    )
    bauds: tuple[int, ...] = Field((), description="baud rates by value of the register Baud Rate")
    modes: tuple[int, ...] = Field((), description="values that Operating Mode accepts")
    ram_from: int = Field(gt=0, lt=TABLE_BYTES, description="first address of the RAM area")
    fast_read_firmware: int | None = Field(
        None, ge=0, description="first firmware with fast sync read; default: none has it"
    )
    firmware: int = Field(1, ge=0, le=255, description="version that a simulated servo reports")
    alarms: tuple[Alarm, ...] = Field(
        ("overload", "overheating", "voltage", "encoder", "shock"),
        description="errors that the servo detects",
    )
    indirect: tuple[Block, ...] = Field(
        (),
        description="blocks of indirect registers: [first address, first data, number of each]",
    )
    units: UnitsRow
    motor: MotorRow | None = Field(
        None, description="a table [motor]; without it the model cannot be simulated"
    )
    friction: FrictionRow | None = Field(
        None, description="a table [friction]; default: not measured"
    )
    registers: dict[str, RegisterRow] = Field(
        min_length=2, description="table of the registers: a row by the name of each register"
    )

    @model_validator(mode="after")
    def _registers_do_not_overlap(self) -> Self:
        rows = sorted(self.registers.items(), key=lambda row: row[1].address)
        for (name, row), (after, other) in pairwise(rows):
            if row.address + row.size > other.address:
                raise ValueError(
                    f"registers: {name} ({row.size} byte(s) at {row.address}) overlaps {after} "
                    f"(at {other.address})"
                )
        last = rows[-1][1]
        if last.address + last.size > TABLE_BYTES:
            raise ValueError(f"registers: {rows[-1][0]} ends beyond address {TABLE_BYTES - 1}")
        return self

    @model_validator(mode="after")
    def _tables_are_complete(self) -> Self:
        needed = {2: ("Model Number", "ID"), 1: _OF_PROTOCOL_1, "feetech": _OF_FEETECH}[
            self.protocol
        ]
        missing = [name for name in needed if name not in self.registers]
        if missing:
            raise ValueError(f"registers: {', '.join(missing)} missing")
        if len(set(self.bauds)) != len(self.bauds) or any(baud <= 0 for baud in self.bauds):
            raise ValueError("bauds: positive rates, each once")
        possible_modes = FEETECH_MODES if self.is_feetech else MODES
        unknown = [mode for mode in self.modes if mode not in possible_modes]
        if unknown:
            shown = ", ".join(map(str, possible_modes))
            raise ValueError(f"modes: {unknown[0]} is not known; known are {shown}")
        for address, data, count in self.indirect:
            ends = (address + 2 * count, data + count)
            if min(address, data, count) <= 0 or max(ends) > TABLE_BYTES:
                raise ValueError(f"indirect: [{address}, {data}, {count}] is outside the table")
        if self.motor is not None and self.protocol == 2:
            faults = [*self.missing_for_a_run(), *self._missing(_FOR_THE_SIMULATOR)]
            if self.units.acceleration_rpm2 is None:
                faults.append("units.acceleration_rpm2")
            if faults:
                raise ValueError(f"motor: the simulated servo also needs {', '.join(faults)}")
        return self

    def missing_for_a_run(self) -> list[str]:
        """Names of the registers and keys that a run needs and the model lacks."""
        missing = [] if self.is_feetech else self._missing(_FOR_A_RUN)
        if not {"Present Current", "Present Load"} & set(self.registers):
            missing.append("Present Current or Present Load")
        if "Present Current" in self.registers and self.units.current_a is None:
            missing.append("units.current_a")
        if self.units.full_pwm is None:
            missing.append("units.full_pwm")
        if not self.bauds:
            missing.append("bauds")
        position_mode = 0 if self.is_feetech else 3
        if position_mode not in self.modes:
            missing.append(f"modes with {position_mode}")
        return missing

    def _missing(self, names: Sequence[str]) -> list[str]:
        return [name for name in names if name not in self.registers]

    @property
    def is_feetech(self) -> bool:
        """Whether the servo speaks Feetech's protocol."""
        return self.protocol == "feetech"

    def mark_of(self, name: str) -> str:
        """First word of a register's mark; ``read`` for a read-only one."""
        row = self.registers[name]
        if row.mark is not None:
            return row.mark.partition(":")[0]
        if row.range is None:
            return "read"
        return "kept" if row.address < self.ram_from else "set"

    def marked(self, *marks: str) -> tuple[str, ...]:
        """Names of the registers with one of some marks."""
        return tuple(name for name in self.registers if self.mark_of(name) in marks)

    @property
    def measures_current(self) -> bool:
        """Whether the servo has a current sensor; without one it reports a load."""
        return "Present Current" in self.registers

    def has_fast_reads(self, firmware: int) -> bool:
        """Whether a servo with this firmware has fast sync read."""
        return self.fast_read_firmware is not None and firmware >= self.fast_read_firmware

    @property
    def stall_current_a(self) -> float | None:
        """Current of a blocked motor at the recommended voltage, or None."""
        return None if self.motor is None else self.motor.stall_current_a

    @property
    def full_output_rad(self) -> float:
        """Position error at which a P gain of 1 gives full output."""
        divisor = _P_GAIN_DIVISOR if self.motor is None else self.motor.p_gain_divisor
        turn = self.units.positions_per_turn
        return (self.units.full_pwm or 0) * divisor * 2.0 * math.pi / turn

    @property
    def rad_per_position(self) -> float:
        """Angle of one position."""
        return math.tau / self.units.positions_per_turn

    @property
    def positions_per_rad(self) -> float:
        """Positions of one radian."""
        return self.units.positions_per_turn / math.tau

    @property
    def rad_s_per_velocity(self) -> float:
        """Speed of one unit of velocity."""
        return self.units.velocity_rpm * 2.0 * math.pi / 60.0

    @property
    def rad_s2_per_acceleration(self) -> float:
        """Acceleration of one unit of Profile Acceleration, or NaN."""
        rpm2 = self.units.acceleration_rpm2
        return math.nan if rpm2 is None else rpm2 * 2.0 * math.pi / 3600.0


def wire_format(facts: ServoModel) -> tuple[int | str, str, bool]:
    """Protocol, byte order and group read of a model; servos on one port agree in them."""
    return facts.protocol, facts.byte_order, facts.sync_read


def protocol_name(facts: ServoModel) -> str:
    """Protocol of a model in words."""
    if facts.is_feetech:
        return "Feetech's protocol"
    return f"Protocol {facts.protocol}.0"
