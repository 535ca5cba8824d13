"""Alarms of a servo of Protocol 1.0: a blocked shaft, heat, a supply out of range.

An alarm is a bit of the error byte of every reply while its cause lasts. Alarms in the mask of
Shutdown(18) also set Torque Limit(34) to 0 and switch the torque off, until the cause has ended and
Torque Limit is set again, or until power-on. (e-manual, AX-12A, Alarm Shutdown, Torque Limit;
Protocol 1.0, Error.)
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Indices
from snakewalk.drivers.protocol.protocol1 import Error1
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.blocked_shaft import BlockedShaft
from snakewalk.sim.servo.motor import MotorModel
from snakewalk.sim.servo.protection import OVERLOAD_S, SLOW
from snakewalk.sim.servo.servo_loops import count_blocked
from snakewalk.sim.servo.supply import Supply

AMBIENT_C = 25.0
ALARMS: Mapping[str, int] = {
    "overload": Error1.OVERLOAD,
    "overheating": Error1.OVERHEATING,
    "voltage": Error1.VOLTAGE,
}
"""Alarms by their names in a fault file; the servo has no others."""


class Ax12Alarms:
    """Alarms of S servos, whose registers are ``register(name)`` (S,)."""

    known: Mapping[str, int] = ALARMS
    """Errors that the servos detect, by the words of a fault file, and their bits."""

    def __init__(
        self,
        register: Callable[[str], NDArray[np.unsignedinteger]],
        drive: ServoDrive,
        motor: MotorModel,
        blocked_shaft: BlockedShaft,
        supply_v: float,
    ) -> None:
        servos = len(drive.torque_on)
        self._register = register
        self._drive = drive
        self._motor = motor
        self._blocked_shaft = blocked_shaft
        self._supply = Supply(servos, supply_v)
        self._blocked_s = np.zeros(servos)
        self._slow_rad_s = np.full(servos, SLOW * motor.no_load_rad_s)
        self._latched = np.zeros(servos, np.uint8)
        self.shown = np.zeros(servos, np.uint8)
        """(S,) alarm bits in the replies of the servos."""
        self.temperature_c = np.full(servos, AMBIENT_C)
        """(S,) of the housings: first order in the winding's loss."""

    def alarms(self, row: int) -> Mapping[str, int]:
        """Errors that a servo can detect, and their bits."""
        del row
        return self.known

    def supply(self, volts: float | None, rows: Indices | None = None) -> None:
        """Set the supply of all servos, or of ``rows``; None: the usual voltage."""
        self._supply.change(volts, rows)

    def heat(self, rows: Indices, celsius: float) -> None:
        """Set housing temperatures."""
        self.temperature_c[rows] = celsius

    def detect(self, rows: Indices, error: int) -> None:
        """Raise an error of some servos until ``reset``."""
        self._latched[rows] |= np.uint8(error)
        self._shut_down()

    def reset(self, rows: Indices | int) -> None:
        """Clear latched alarms; a lasting cause raises its alarm again."""
        self._latched[rows] = 0
        self._blocked_s[rows] = 0.0
        self.shown[rows] = 0

    def check(self, seconds: float, velocity_rad_s: Floats) -> None:
        """Update heat and alarms after ``seconds``."""
        drive = self._drive
        motor = self._motor
        self._supply.feed(drive.supply_v)
        amps = self._blocked_shaft.current_a()
        pwm = self._blocked_shaft.pwm()
        target_c = AMBIENT_C + motor.winding_k_per_w * motor.resistance_ohm * amps**2
        share = 1.0 - np.exp(-seconds / motor.thermal_time_s)
        self.temperature_c += (target_c - self.temperature_c) * share
        full = self._full_output()
        on = drive.torque_on
        slow_rad_s = self._slow_rad_s
        count_blocked(self._blocked_s, seconds, pwm, full, on, velocity_rad_s, slow_rad_s)
        tenths = np.rint(drive.supply_v * 10.0)
        low, high = self._register("Min Voltage Limit"), self._register("Max Voltage Limit")
        hot = np.rint(self.temperature_c) > self._register("Temperature Limit")
        status_bits = Error1.VOLTAGE * ((tenths < low) | (tenths > high))
        overload = self._blocked_s >= self._overload_s()
        status_bits |= Error1.OVERLOAD * overload | Error1.OVERHEATING * hot
        self._latched |= status_bits.astype(np.uint8) & self._register("Shutdown").astype(np.uint8)
        self.shown[:] = self._latched | status_bits
        self._shut_down()

    def _full_output(self) -> Floats:
        """(S,) output at which a motor at rest is overloaded, fraction of the supply."""
        limit = self._drive.pwm_limit
        return np.where(limit > 0.0, limit, 1.0)  # 0 of 0 means no effort

    def _overload_s(self) -> Floats | float:
        return OVERLOAD_S

    def _shut_down(self) -> None:
        self.shown |= self._latched
        off = (self._latched & self._register("Shutdown")) != 0
        self._register("Torque Limit")[off] = 0
        self._register("Torque Enable")[off] = 0
