"""Protections of a servo against heat, a blocked shaft, a supply out of range.

Faults go to Hardware Error Status(70); those in Shutdown(63) switch the torque off until a reboot
(e-manual, Shutdown).
"""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import AnyInts, Floats, Indices
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V, Alarm
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import MotorColumns
from snakewalk.sim.servo.motor_output import AT_LIMIT, MotorOutput
from snakewalk.sim.servo.servo_loops import (
    count_blocked,
    out_of_range,
    supply_current_a,
    warm_up,
)
from snakewalk.sim.servo.supply import SOURCE_OHM, Cabling, Supply, servo_voltages

SLICE_S = 0.05
"""Period of the checks of a servo's protection."""
SLOW = 0.05
"""Share of the no-load speed below which a motor is taken to be held (ours)."""
STARVED = 0.6
"""Share of Min Voltage Limit(34) below which a powered motor is "insufficient power" (ours)."""
OVERLOAD_S = 1.0
"""Longest time at full output against a held shaft ("persistent load", e-manual; the time is
ours)."""
ENCODER_ERROR, SHOCK_ERROR = 0x08, 0x10
"""Bits of Hardware Error Status(70) and Shutdown(63)."""
ALARMS: Mapping[str, int] = {
    "overload": Alarm.OVERLOAD,
    "overheating": Alarm.OVERHEATING,
    "voltage": Alarm.INPUT_VOLTAGE,
    "encoder": ENCODER_ERROR,
    "shock": SHOCK_ERROR,
}
"""Alarms by their names in a fault file."""


@dataclass(frozen=True, slots=True)
class SupplyAndAmbient:
    """Supply and air."""

    supply_v: float | None = None
    """Supply voltage of the servos; None: the nominal voltage of each servo's model."""
    supply_ohm: float = SOURCE_OHM
    """Resistance of battery and cable together; servos of one voltage share a cable."""
    ambient_c: float = 25.0
    cabling: Cabling | None = None
    """Cables between the servos, which then all have one source; None: no drop."""

    @staticmethod
    def of(robot: RobotConfig) -> "SupplyAndAmbient":
        """Supply of a robot's file."""
        power = robot.power
        return SupplyAndAmbient(
            robot.servo.supply_v, cabling=None if power is None else Cabling.of(robot, power)
        )


class Protection:
    """Temperatures, supply and load of all servos of a bank."""

    def __init__(
        self,
        bank: ServoBank,
        drive: ServoDrive,
        motor: MotorColumns,
        around: SupplyAndAmbient,
        motor_output: MotorOutput,
    ) -> None:
        self._bank = bank
        self._drive = drive
        self._around = around
        self._motor_output = motor_output
        self._supply = Supply(
            len(bank), motor.nominal_v if around.supply_v is None else around.supply_v
        )
        self.temperature_c = np.full(len(bank), around.ambient_c)
        """(S,) at the sensor: first order in the winding's loss."""
        self.full = np.ones(len(bank))
        """(S,) output beyond which a motor cannot go, fraction of the supply."""
        self._blocked_s = np.zeros(len(bank))
        names = "Min Voltage Limit", "Max Voltage Limit", "Temperature Limit"
        self._limits = bank[names[0]], bank[names[1]], bank[names[2]]
        shares = [1.0 - math.exp(-SLICE_S / seconds) for seconds in motor.thermal_time_s]
        self._thermal = np.stack([motor.winding_k_per_w, shares])
        self._slow_rad_s = SLOW * motor.no_load_rad_s
        self._drop_v = np.zeros(len(bank))
        volts = self._supply.usual_v
        several = [np.flatnonzero(volts == volt) for volt in np.unique(volts)]
        self._cables = [
            (rows, sum(amps * count for amps, count in Counter(motor.standby_a[rows]).items()))
            for rows in (several if len(several) > 1 else [slice(None)])
        ]
        """Rows of the servos on a cable, and what they draw at rest, A."""
        self._standby_a = motor.standby_a

    def alarms(self, row: int) -> Mapping[str, int]:
        """Errors that a servo can detect, and their bits."""
        present_kinds = self._bank.facts[row].alarms
        return {kind: bit for kind, bit in ALARMS.items() if kind in present_kinds}

    def supply(self, volts: float | None, rows: Indices | None = None) -> None:
        """Set the supply of all servos, or of ``rows``; None: the usual voltage."""
        self._supply.change(volts, rows)

    def heat(self, rows: Indices, celsius: float) -> None:
        """Set housing temperatures."""
        self.temperature_c[rows] = celsius

    def detect(self, rows: Indices, error: int) -> None:
        """Raise an error of some servos; Shutdown(63) may end the torque."""
        self._set_errors(np.isin(np.arange(len(self._bank)), rows) * error)

    def restart(self, rows: Indices) -> None:
        """Restart the overload count; heat stays."""
        self._blocked_s[rows] = 0.0

    def check(self, plant: Plant) -> bool:
        """Check all servos after a slice of ``SLICE_S``; return whether registers changed."""
        heat_j = self._motor_output.take_heat_j(SLICE_S)
        warm_up(self.temperature_c, heat_j, SLICE_S, self._around.ambient_c, self._thermal)
        drive = self._drive
        pwm = self._motor_output.pwm(plant.velocity_rad_s)
        self._sag(pwm, drive.supply_v)
        longest_s = count_blocked(
            self._blocked_s,
            SLICE_S,
            pwm,
            self.full,
            drive.torque_on,
            plant.velocity_rad_s,
            self._slow_rad_s,
        )
        low, high, hottest = self._limits
        wrong = out_of_range(self.temperature_c, hottest, drive.supply_v, low, high)
        if longest_s < OVERLOAD_S and not wrong:  # a starved servo is out of range too
            return False
        tenths = np.rint(drive.supply_v * 10.0)
        outside = (tenths < low) | (tenths > high)
        hot = np.rint(self.temperature_c) > hottest
        overload = self._blocked_s >= OVERLOAD_S
        starved = (drive.supply_v < STARVED * low * VOLTAGE_UNIT_V) & (drive.torque_on > 0)
        self._set_errors(
            Alarm.INPUT_VOLTAGE * outside
            | Alarm.OVERHEATING * hot
            | Alarm.OVERLOAD * overload
            | SHOCK_ERROR * starved
        )
        return True

    def _set_errors(self, errors: AnyInts) -> None:
        bank = self._bank
        bank["Hardware Error Status"][:] |= errors.astype(np.uint8)
        bank["Torque Enable"][(bank["Hardware Error Status"] & bank["Shutdown"]) != 0] = 0

    def supply_v(self, velocity_rad_s: Floats) -> Floats:
        """(S,) voltage measured by the servos under the present currents.

        The motors keep the voltage of the last check for a slice.
        """
        out = np.empty_like(self._drive.supply_v)
        self._sag(self._motor_output.pwm(velocity_rad_s), out)
        return out

    def _sag(self, pwm: Floats, out: Floats) -> None:
        """Write the voltage at each servo (S,) under the present currents to ``out``."""
        current_a = self._motor_output.current_a()
        if self._around.cabling is not None:
            self._sag_along(self._around.cabling, pwm, current_a)
        else:
            for rows, standby_a in self._cables:
                drawn_a = float(supply_current_a(pwm[rows], current_a[rows])) + standby_a
                self._drop_v[rows] = self._around.supply_ohm * drawn_a
        self._supply.feed(out, self._drop_v)

    def _sag_along(self, cabling: Cabling, pwm: Floats, current_a: Floats) -> None:
        """Compute the sag along the chain; output and shaft speed stay constant.

        A bridge draws more at a higher voltage, by ``pwm^2 / R``, unless its current is limited. So
        the voltages of the whole chain are solved at once, even if cables cause most of the drop.
        """
        drive = self._drive
        drives = (pwm * current_a > 0.0) & (np.abs(current_a) < AT_LIMIT * drive.current_limit_a)
        slope_s = pwm * pwm / drive.resistance_ohm * drives
        at_zero_a = np.abs(pwm * current_a) - slope_s * drive.supply_v + self._standby_a
        source_v = self._supply.source_v
        cables_ohm, leads_ohm = cabling.cable_ohm, cabling.lead_ohm
        around_ohm = self._around.supply_ohm
        servo_voltages(
            source_v, around_ohm, at_zero_a, slope_s, cables_ohm, leads_ohm, self._drop_v
        )
        self._drop_v[:] = source_v - np.maximum(self._drop_v, 0.0)
