"""What a servo guards itself against: heat, a blocked shaft, a supply out of range.

Detected faults go to Hardware Error Status(70); those in the mask of Shutdown(63) switch the torque
off until a reboot (e-manual, Shutdown).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V, Alarm
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import MotorModel
from snakewalk.sim.servo.motor_output import MotorOutput
from snakewalk.sim.servo.servo_loops import (
    add_loss,
    count_blocked,
    out_of_range,
    supply_current_a,
    warm_up,
)
from snakewalk.sim.servo.supply import Supply

SLICE_S = 0.05
"""How often this is looked at; the shafts are seen far more often."""
STARVED = 0.6
"""Share of Min Voltage Limit(34) below which a powered motor is "insufficient power" (ours)."""
OVERLOAD_S = 1.0
"""How long a motor at full output may be held ("persistent load", e-manual; the time is ours)."""
ENCODER_ERROR, SHOCK_ERROR = 0x08, 0x10
"""Bits of Hardware Error Status(70) and Shutdown(63)."""
ALARMS: Mapping[str, int] = {
    "overload": Alarm.OVERLOAD,
    "overheating": Alarm.OVERHEATING,
    "voltage": Alarm.INPUT_VOLTAGE,
    "encoder": ENCODER_ERROR,
    "shock": SHOCK_ERROR,
}
"""By the words of a fault file."""
ALARMS_330: Mapping[str, int] = {kind: bit for kind, bit in ALARMS.items() if kind != "encoder"}
"""Bit 3 of the 330 models is not used (e-manual, XL330, Shutdown)."""


@dataclass(frozen=True, slots=True)
class SupplyAndAmbient:
    """Supply and air."""

    supply_v: float
    supply_ohm: float = 0.02
    """Of battery and cable together: the voltage sags with the current of all servos."""
    ambient_c: float = 25.0


class Protection:
    """Temperatures, supply and load of all servos of a bank."""

    def __init__(
        self,
        bank: ServoBank,
        drive: ServoDrive,
        motor: MotorModel,
        around: SupplyAndAmbient,
        motor_output: MotorOutput,
    ) -> None:
        self._bank, self._drive, self._motor, self._around = bank, drive, motor, around
        self._motor_output = motor_output
        self._supply = Supply(len(bank), around.supply_v)
        self.temperature_c = np.full(len(bank), around.ambient_c)
        """(S,) at the sensor: first order in the winding's loss."""
        self.full = np.ones(len(bank))
        """(S,) output beyond which a motor cannot go, fraction of the supply."""
        self._ohm = motor.resistance_ohm
        self._heat_j = np.zeros(len(bank))
        self._blocked_s = np.zeros(len(bank))
        names = "Min Voltage Limit", "Max Voltage Limit", "Temperature Limit"
        self._limits = bank[names[0]], bank[names[1]], bank[names[2]]
        share = 1.0 - math.exp(-SLICE_S / motor.thermal_time_s)
        self._thermal = np.array([around.ambient_c, motor.winding_k_per_w, share])

    def alarms(self, row: int) -> Mapping[str, int]:
        """What a servo can detect."""
        del row
        return ALARMS_330 if "PWM Slope" in self._bank else ALARMS

    def supply(self, volts: float | None, rows: NDArray[np.intp] | None = None) -> None:
        """Change the supply of all, or of ``rows``; None: as it was."""
        self._supply.change(volts, rows)

    def heat(self, rows: NDArray[np.intp], celsius: float) -> None:
        """Set housings to a temperature."""
        self.temperature_c[rows] = celsius

    def detect(self, rows: NDArray[np.intp], error: int) -> None:
        """Let servos find an error: shown, and off with the torque if Shutdown(63) says so."""
        self._note(np.isin(np.arange(len(self._bank)), rows) * error)

    def restart(self, rows: NDArray[np.intp]) -> None:
        """Forget what led up to an overload; heat stays."""
        self._blocked_s[rows] = 0.0

    def pass_time(self, seconds: float) -> None:
        """Add up the windings' loss at the present currents."""
        add_loss(self._heat_j, self._motor_output.current_a(), seconds * self._ohm)

    def look(self, plant: Plant) -> bool:
        """Judge one slice of ``SLICE_S``; whether registers have changed."""
        self._warm_up()
        drive = self._drive
        pwm = self._motor_output.pwm(plant.velocity_rad_s)
        volts = self._sag(pwm)
        apart = self._supply.apart
        longest_s = count_blocked(
            self._blocked_s,
            SLICE_S,
            pwm,
            self.full,
            drive.torque_on,
            plant.velocity_rad_s,
            0.05 * self._motor.no_load_rad_s,
        )
        low, high, hottest = self._limits
        wrong = out_of_range(self.temperature_c, hottest, round(volts * 10.0), low, high)
        if longest_s < OVERLOAD_S and not (wrong or apart):  # starved is outside, too
            return False
        tenths = np.rint(drive.supply_v * 10.0)
        outside = (tenths < low) | (tenths > high)
        hot = np.rint(self.temperature_c) > hottest
        overload = self._blocked_s >= OVERLOAD_S
        starved = (drive.supply_v < STARVED * low * VOLTAGE_UNIT_V) & (drive.torque_on > 0)
        self._note(
            Alarm.INPUT_VOLTAGE * outside
            | Alarm.OVERHEATING * hot
            | Alarm.OVERLOAD * overload
            | SHOCK_ERROR * starved
        )
        return True

    def _note(self, errors: NDArray[np.integer]) -> None:
        bank = self._bank
        bank["Hardware Error Status"][:] |= errors.astype(np.uint8)
        bank["Torque Enable"][(bank["Hardware Error Status"] & bank["Shutdown"]) != 0] = 0

    def _warm_up(self) -> None:
        self._thermal[0] = self._around.ambient_c
        warm_up(self.temperature_c, self._heat_j, SLICE_S, self._thermal)

    def _sag(self, pwm: Floats) -> float:
        drive = self._drive
        servos_a = float(supply_current_a(pwm, self._motor_output.current_a()))
        drawn_a = servos_a + self._motor.standby_a * len(self._bank)
        drop_v = self._around.supply_ohm * drawn_a
        volts = self._supply.volts - drop_v
        drive.supply_v[:] = volts
        if self._supply.apart:
            self._supply.feed(drive.supply_v, drop_v)
        return volts
