"""Shafts that something holds: a jammed gear, or a body in the way.

Plants know no jam, so a jammed servo's drive becomes a stiff brake at the place, and what its
registers show is what the real one would: the output its error asks for, and the stall current.
"""

import numpy as np
from numpy.typing import NDArray

from sim.bus.motor import MotorModel
from sim.plant import ServoDrive

Floats = NDArray[np.float64]

STIFF_PER_RAD = 20.0
"""PWM fraction a radian of the brake: an order above the servos' own gains."""
STRENGTH = 4.0
"""Brake over stall torque."""


class Jam:
    """The jammed servos of a bus."""

    def __init__(self, drive: ServoDrive, motor: MotorModel) -> None:
        self._drive, self._motor = drive, motor
        servos = len(drive.torque_on)
        self._rows = np.zeros(servos, bool)
        self._at_rad = np.zeros(servos)
        self._output = np.zeros(servos)
        self.any = False
        """Whether a servo is jammed."""

    def seize(self, row: int, at_rad: float) -> None:
        """Hold a shaft where it is; the firmware then takes over its registers again."""
        self._rows[row], self._at_rad[row], self.any = True, at_rad, True

    def free(self, row: int) -> None:
        """Let go of a shaft."""
        self._rows[row] = False
        self.any = bool(self._rows.any())

    def hold(self) -> None:
        """Turn the jammed servos' drive, as the registers have just set it, into a brake."""
        if not self.any:
            return
        drive, rows = self._drive, self._rows
        fresh = drive.pwm_limit <= 1.0
        wanted = drive.p_gain_per_rad * (drive.goal_rad - self._at_rad)
        limited = np.clip(wanted, -drive.pwm_limit, drive.pwm_limit) * drive.torque_on
        self._output = np.where(rows & fresh, limited, self._output)
        drive.torque_on[rows] = 1.0
        drive.p_gain_per_rad[rows] = STIFF_PER_RAD
        drive.goal_rad[rows] = self._at_rad[rows]
        drive.pwm_limit[rows] = STRENGTH
        drive.current_limit_a[rows] = np.inf

    def pwm(self) -> Floats:
        """(S,) output as the servos see it, fraction of the supply."""
        return np.where(self._rows, self._output, self._drive.pwm) if self.any else self._drive.pwm

    def current_a(self) -> Floats:
        """(S,) current as the servos measure it."""
        if not self.any:
            return self._drive.current_a
        stall = self._output * self._drive.supply_v / self._drive.resistance_ohm
        return np.where(self._rows, stall, self._drive.current_a)
