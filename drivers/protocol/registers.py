"""Register values common to all series of Protocol 2.0: modes, alarm bits, units.

Model files (``config/servos``) have the differences. A model without a current sensor has Present
Load, the share of full output, in place of Present Current. The host rejects a model with an
unknown unit of current.
"""

import math
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from snakewalk.config.arrays import Floats, SignedInts
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.errors import ControlTableError

LOAD_UNIT = 1e-3
"""Present Load(126) of models without a current sensor: of full output."""
VOLTAGE_UNIT_V = 0.1
"""Present Input Voltage(144), all series of Protocol 2.0."""
WATCHDOG = "Bus Watchdog"
"""Name of register 98, the bus watchdog; Feetech servos have none."""
WATCHDOG_UNIT_S = 0.02
"""Unit of Bus Watchdog(98)."""
WATCHDOG_TICKS_MAX = 127
"""Greatest time of Bus Watchdog(98), in its units."""
WATCHDOG_TRIPPED = 0xFF
"""Value of Bus Watchdog(98) in its error state."""
RETURN_DELAY_UNIT_S = 2e-6
"""Unit of Return Delay Time(9)."""
CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE = 0, 1, 3, 4
CURRENT_POSITION_MODE = 5
PWM_MODE = 16

NO_SECONDARY_ID = 255
"""Secondary(Shadow) ID(12): values from 253 mean that it is not used."""
SECONDARY_ID_LIMIT = 252
REVERSE = 0x01
TIME_PROFILE = 0x04
TORQUE_ON_BY_GOAL = 0x08
"""Bits 0, 2 and 3 of Drive Mode(10)."""
SHUTDOWN_ALARMS = 0x34
"""Shutdown(63): the alarms that switch a servo off by its factory setting: overload, electrical
shock, overheating."""


class Alarm(IntFlag):
    """Bits of Hardware Error Status(70)."""

    INPUT_VOLTAGE = 0x01
    OVERHEATING = 0x04
    MOTOR_ENCODER = 0x08
    ELECTRICAL_SHOCK = 0x10
    OVERLOAD = 0x20
    OVER_CURRENT = 0x40
    """Feetech servos only; ``feetech.alarm_of`` converts their alarms to these bits."""


def alarm_names(hardware_error: int) -> str:
    """Alarms of register 70 in words; empty without one."""
    names = {alarm.value: (alarm.name or "").lower().replace("_", " ") for alarm in Alarm}
    bits = (bit for bit in range(8) if hardware_error >> bit & 1)
    return ", ".join(names.get(1 << bit, f"bit {bit}") for bit in bits)


@dataclass(frozen=True, slots=True)
class ServoUnits:
    """Scales of one model; arrays keep their shape."""

    zero_position: int
    """Raw position of a straight joint."""
    rad_per_position: float
    rad_s_per_velocity: float
    a_per_current: float
    """Ampere of one unit of Present Current. Without a sensor: of one unit of Present Load at
    rest."""
    measures_current: bool
    full_pwm: int
    """Goal PWM of full output."""
    stall_current_a: float
    """Stall current of the motor; NaN if the model's file does not give it."""
    limits_current: bool
    """Whether the model has current-based position control."""

    @staticmethod
    def of(facts: ServoModel) -> "ServoUnits":
        """Scales of a model.

        Raises:
            ControlTableError: the model's file lacks values for a run.

        """
        missing = facts.missing_for_a_run()
        measures = facts.measures_current
        stall_a = facts.stall_current_a
        current_a = facts.units.current_a if measures else None
        if not measures and stall_a is not None:
            current_a = stall_a * LOAD_UNIT
        if not measures and stall_a is None:
            missing.append("motor.stall_current_a")
        if missing or current_a is None or facts.units.full_pwm is None:
            raise ControlTableError(
                f"{facts.model}: its file lacks {', '.join(missing)}; a run needs "
                "them: docs/how-to/add-a-servo-model.md"
            )
        if facts.is_feetech:
            limits_current = "Goal Current" in facts.registers
        else:
            limits_current = measures and CURRENT_POSITION_MODE in facts.modes
        return ServoUnits(
            facts.units.zero_position,
            facts.rad_per_position,
            facts.rad_s_per_velocity,
            current_a,
            measures,
            facts.units.full_pwm,
            math.nan if stall_a is None else stall_a,
            limits_current,
        )

    def position_rad(self, raw: SignedInts) -> Floats:
        """Angles, rad; 0 is straight."""
        return np.asarray((raw - float(self.zero_position)) * self.rad_per_position)

    def velocity_rad_s(self, raw: SignedInts) -> Floats:
        """Velocities, rad/s."""
        return np.asarray(raw * self.rad_s_per_velocity)

    def current_a(self, raw: SignedInts) -> Floats:
        """Currents, A."""
        return np.asarray(raw * self.a_per_current)

    def current_raw(self, current_a: float) -> int:
        """Nearest raw current."""
        return round(current_a / self.a_per_current)


BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Rates at which commands look for servos of unknown rate; the order is that of an IMU's codes."""
FACTORY_BAUD = 57_600


def bauds_of(facts: ServoModel) -> tuple[int, ...]:
    """Baud rates of a model, by code.

    Raises:
        ControlTableError: its file lacks them.

    """
    if not facts.bauds:
        raise ControlTableError(f"{facts.model}: its file gives no baud rates")
    return facts.bauds


def baud_code(facts: ServoModel, baud: int) -> int:
    """Value of the register Baud Rate.

    Raises:
        ControlTableError: the model lacks that rate.

    """
    rates = bauds_of(facts)
    if baud not in rates:
        raise ControlTableError(f"{baud} baud: a {facts.model} has {', '.join(map(str, rates))}")
    return rates.index(baud)
