"""What register values mean: units, operating modes, alarm bits, baud rates; for host and servo.

The host scales positions and velocities by the SDK's control tables. For the current these tables
give "raw", or a torque, so its unit is here, from the e-manual's page of each model, Current
Limit(38) and Present Current(126). A model without a current sensor has Present Load(126) in its
place, the share of full output. The host refuses other models: a current of unknown scale must not
look like zero, or safe.
"""

from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from snakewalk.config.arrays import Floats, SignedInts
from snakewalk.config.robot import STALL_CURRENT_A
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import ControlTable

CURRENT_UNIT_A = {
    **dict.fromkeys(("XM430-W210", "XM430-W350", "XM540-W150", "XM540-W270"), 2.69e-3),
    **dict.fromkeys(("XH430-W210", "XH430-W350"), 2.69e-3),
    **dict.fromkeys(("XH430-V210", "XH430-V350"), 1.34e-3),
    **dict.fromkeys(("XL330-M077", "XL330-M288"), 1e-3),
    **dict.fromkeys(("XC330-M181", "XC330-M288", "XC330-T181", "XC330-T288"), 1e-3),
    **dict.fromkeys(("PH42-020-S300", "PH54-100-S500", "PH54-200-S500"), 1e-3),
    **dict.fromkeys(("PM42-010-S260", "PM54-040-S250", "PM54-060-S250"), 1e-3),
}
"""Present Current(126), by model."""
LOAD_UNIT = 1e-3
"""Present Load(126) of models without a current sensor: of full output."""
VOLTAGE_UNIT_V = 0.1
"""Present Input Voltage(144), all series of Protocol 2.0."""
WATCHDOG_UNIT_S = 0.02
"""Bus Watchdog(98)."""
WATCHDOG_TICKS_MAX = 127
"""Greatest time of it, in its units."""
WATCHDOG_TRIPPED = 0xFF
"""Bus Watchdog(98) reads -1 in its error state."""
RETURN_DELAY_UNIT_S = 2e-6
"""Return Delay Time(9)."""
VELOCITY_UNIT_RAD_S = 0.229 * 2.0 * np.pi / 60.0
"""Profile Velocity(112), Present Velocity(128): 0.229 rev/min a unit; the SDK's files round it."""
ACCELERATION_UNIT_RAD_S2 = 214.577 * 2.0 * np.pi / 3600.0
"""Profile Acceleration(108): 214.577 rev/min^2 a unit."""
CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE = 0, 1, 3, 4
CURRENT_POSITION_MODE, PWM_MODE = 5, 16
MODES = (0, 1, 3, 4, 5, 16)
"""Operating Mode(11)."""
CURRENT_MODES = (CURRENT_MODE, CURRENT_POSITION_MODE)
"""Those that a model without current sensing lacks."""

PWM_FULL = 885
"""Goal PWM(100) and PWM Limit(36) of full output, X series."""
NO_SECONDARY_ID = 255
"""Secondary(Shadow) ID(12): values from 253 on are none."""
SECONDARY_ID_LIMIT = 252
REVERSE, TIME_PROFILE, TORQUE_ON_BY_GOAL = 0x01, 0x04, 0x08
"""Drive Mode(10), bits 0, 2 and 3."""
SHUTDOWN_ALARMS = 0x34
"""Shutdown(63): the alarms that switch a servo off by its factory setting: overload, electrical
shock, overheating."""


HOMING_LIMIT = 1_024
"""Homing Offset(20) beyond this, either way, is ignored in position control mode (e-manual)."""
EEPROM_END = 64
"""Addresses below are the EEPROM area, X series: locked while Torque Enable(64) is 1."""


class Alarm(IntFlag):
    """Bits of Hardware Error Status(70)."""

    INPUT_VOLTAGE = 0x01
    OVERHEATING = 0x04
    MOTOR_ENCODER = 0x08
    ELECTRICAL_SHOCK = 0x10
    OVERLOAD = 0x20


def alarm_names(hardware_error: int) -> str:
    """Bits of register 70 in words; empty without an alarm."""
    names = {alarm.value: (alarm.name or "").lower().replace("_", " ") for alarm in Alarm}
    bits = (bit for bit in range(8) if hardware_error >> bit & 1)
    return ", ".join(names.get(1 << bit, f"bit {bit}") for bit in bits)


@dataclass(frozen=True, slots=True)
class ServoUnits:
    """Scales of one model; arrays in, arrays of the same shape out."""

    zero_position: int
    """Raw position of a straight joint."""
    rad_per_position: float
    rad_s_per_velocity: float
    a_per_current: float
    """Of Present Current(126); without a sensor the stall current's share in a unit of Present
    Load(126): what the motor would draw at rest, more than it draws while it turns."""
    measures_current: bool = True

    @staticmethod
    def of(table: ControlTable) -> "ServoUnits":
        """Scales for a control table.

        Raises:
            ControlTableError: the velocity's or the current's unit is not known.

        """
        faults = []
        velocity, current = table.rad_s_per_velocity, CURRENT_UNIT_A.get(table.model)
        measures = "Present Current" in table
        if not measures and table.model in STALL_CURRENT_A:
            current = STALL_CURRENT_A[table.model] * LOAD_UNIT
        if velocity is None:
            faults.append(f"{table.model}: the SDK's table gives no unit of velocity")
        if current is None:
            faults.append(
                f"{table.model}: unit of current not known; known are "
                f"{', '.join(sorted(CURRENT_UNIT_A))}"
            )
        if velocity is None or current is None:
            raise ControlTableError(faults)
        return ServoUnits(table.zero_position, table.rad_per_position, velocity, current, measures)

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
"""Baud Rate(8), by value."""
FACTORY_BAUD = 57_600
_UP_TO_4M = ("XL330", "XC330")
_ALL = ("XL430", "XC430", "XM", "XH", "XD", "XW", "MX", "2X")


def bauds_of(model: str) -> tuple[int, ...]:
    """Baud rates of a model, by code.

    Raises:
        ControlTableError: its series is not known here.

    """
    if model.startswith(_UP_TO_4M):
        return BAUDS[:-1]
    if model.startswith(_ALL):
        return BAUDS
    raise ControlTableError(f"{model}: baud rate codes not known; known are the X and MX series")


def baud_code(model: str, baud: int) -> int:
    """Value of register 8.

    Raises:
        ControlTableError: the model does not have that rate.

    """
    rates = bauds_of(model)
    if baud not in rates:
        shown = ", ".join(map(str, rates))
        raise ControlTableError(f"{baud} baud: a {model} has {shown}")
    return rates.index(baud)
