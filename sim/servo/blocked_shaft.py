"""Blocked shafts: a blocked gear, or an obstacle to the body.

A plant has no blocked shafts, so the drive of a blocked servo becomes a stiff brake at that angle.
Its registers show the values of a real servo: the output for its error, and the stall current.
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.sim.plant import ServoDrive

STIFF_PER_RAD = 20.0
"""PWM fraction a radian of the brake: an order above the servos' own gains."""
STRENGTH = 4.0
"""Torque of the brake on a blocked shaft over the stall torque."""


class BlockedShaft:
    """Blocked servos of a bus, their drive and registers."""

    def __init__(self, drive: ServoDrive) -> None:
        self._drive = drive
        servos = len(drive.torque_on)
        self.rows = np.zeros(servos, bool)
        """(S,) whether the shaft of a servo is blocked."""
        self._at_rad = np.zeros(servos)
        self._output = np.zeros(servos)
        self._gain = np.zeros(servos)
        self._on, self._limit = np.zeros(servos), np.ones(servos)
        self._limit_a = np.full(servos, np.inf)
        self.any = False
        """Whether a servo is blocked."""

    def block(self, row: int, at_rad: float) -> None:
        """Hold a shaft; the firmware then applies its registers again."""
        self.rows[row] = True
        self._at_rad[row] = at_rad
        self.any = True

    def free(self, row: int) -> None:
        """Release a shaft."""
        self.rows[row] = False
        self.any = bool(self.rows.any())

    def hold(self, fresh: Bools | None = None) -> None:
        """Turn the newly set drive of blocked servos into a brake.

        ``fresh`` (S,) are the servos with a new goal; None: all.
        """
        if not self.any:
            return
        drive = self._drive
        rows = self.rows
        updated = rows & (drive.pwm_limit <= 1.0)  # else it is still the brake's
        self._on = np.where(updated, drive.torque_on, self._on)
        self._limit = np.where(updated, drive.pwm_limit, self._limit)
        self._limit_a = np.where(updated, drive.current_limit_a, self._limit_a)
        new_gain = rows & (drive.p_gain_per_rad != STIFF_PER_RAD)
        self._gain = np.where(new_gain, drive.p_gain_per_rad, self._gain)
        output = self._gain * (drive.goal_rad - self._at_rad)
        limited = np.clip(output, -self._limit, self._limit) * self._on
        changed = rows if fresh is None else rows & fresh
        self._output = np.where(changed, limited, self._output)
        drive.torque_on[rows] = 1.0
        drive.p_gain_per_rad[rows] = STIFF_PER_RAD
        drive.goal_rad[rows] = self._at_rad[rows]
        drive.pwm_limit[rows] = STRENGTH
        drive.current_limit_a[rows] = np.inf

    def pwm(self) -> Floats:
        """(S,) output in the servos' registers, fraction of the supply."""
        return np.where(self.rows, self._output, self._drive.pwm) if self.any else self._drive.pwm

    def current_a(self) -> Floats:
        """(S,) measured current."""
        if not self.any:
            return self._drive.current_a
        stall = self._output * self._drive.supply_v / self._drive.resistance_ohm
        stall = np.clip(stall, -self._limit_a, self._limit_a)
        return np.where(self.rows, stall, self._drive.current_a)

    def limit_a(self) -> Floats:
        """(S,) current limit in the registers."""
        limit_a = self._drive.current_limit_a
        return np.where(self.rows, self._limit_a, limit_a) if self.any else limit_a
