"""What a servo guards itself against: heat, a blocked shaft, a supply out of range.

Detected faults go to Hardware Error Status(70); those in the mask of Shutdown(63) switch the torque
off until a reboot (e-manual, Shutdown).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.bus.bank import ServoBank
from sim.bus.jam import Jam
from sim.bus.kernel import add_loss, count_blocked, drawn, out_of_range, warm_up
from sim.bus.motor import MotorModel
from sim.plant import Plant, ServoDrive

Floats = NDArray[np.float64]

SLICE_S = 0.05
"""How often this is looked at; the shafts are seen far more often."""
STARVED = 0.6
"""Share of Min Voltage Limit(34) below which a powered motor is "insufficient power" (ours)."""
OVERLOAD_S = 1.0
"""How long a motor at full output may be held ("persistent load", e-manual; the time is ours)."""
VOLTAGE_ERROR, OVERHEATING_ERROR, OVERLOAD_ERROR = 0x01, 0x04, 0x20
ENCODER_ERROR, SHOCK_ERROR = 0x08, 0x10
"""Bits of Hardware Error Status(70) and Shutdown(63)."""


@dataclass(frozen=True, slots=True)
class Surroundings:
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
        around: Surroundings,
        jam: Jam,
    ) -> None:
        self._bank, self._drive, self._motor, self._around = bank, drive, motor, around
        self._jam = jam
        self.temperature_c = np.full(len(bank), around.ambient_c)
        """(S,) at the sensor: first order in the winding's loss."""
        self._ohm = motor.resistance_ohm
        self._heat_j = np.zeros(len(bank))
        self._blocked_s = np.zeros(len(bank))
        names = "Min Voltage Limit", "Max Voltage Limit", "Temperature Limit"
        self._limits = bank[names[0]], bank[names[1]], bank[names[2]]
        share = 1.0 - math.exp(-SLICE_S / motor.thermal_time_s)
        self._thermal = np.array([around.ambient_c, motor.winding_k_per_w, share])

    @property
    def supply_v(self) -> float:
        """Voltage of the supply, before the cable."""
        return self._around.supply_v

    def supply(self, volts: float) -> None:
        """Change the supply."""
        self._around = replace(self._around, supply_v=volts)

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
        add_loss(self._heat_j, self._jam.current_a(), seconds * self._ohm)

    def look(self, plant: Plant) -> bool:
        """Judge one slice of ``SLICE_S``; whether registers have changed."""
        self._warm_up()
        volts = self._sag()
        drive = self._drive
        longest_s = count_blocked(
            self._blocked_s,
            SLICE_S,
            self._jam.pwm(),
            drive.pwm_limit,
            drive.torque_on,
            plant.velocity_rad_s,
            0.05 * self._motor.no_load_rad_s,
        )
        low, high, hottest = self._limits
        tenths = round(volts * 10.0)
        wrong = out_of_range(self.temperature_c, hottest, tenths, low, high)
        if longest_s < OVERLOAD_S and not wrong:  # starved is outside, too
            return False
        outside = (tenths < low) | (tenths > high)
        hot = np.rint(self.temperature_c) > hottest
        overload = self._blocked_s >= OVERLOAD_S
        starved = (volts < STARVED * low * 0.1) & (drive.torque_on > 0)
        self._note(
            VOLTAGE_ERROR * outside
            | OVERHEATING_ERROR * hot
            | OVERLOAD_ERROR * overload
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

    def _sag(self) -> float:
        drive = self._drive
        servos_a = float(drawn(drive.pwm, drive.current_a))
        drawn_a = servos_a + self._motor.standby_a * len(self._bank)
        volts = self._around.supply_v - self._around.supply_ohm * drawn_a
        drive.supply_v[:] = volts
        return volts
