"""Output and current of the motors as the servos measure them.

A plant reports the requested output. If a current limit cuts it, or a shaft is blocked, registers
show the remaining output. So a gripper that closes with little current does not look like one at
full output.
"""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.blocked_shaft import BlockedShaft

AT_LIMIT = 0.999
"""Share of its limit from which on a current is taken to be cut."""
LEAST_SUPPLY_V = 0.1
"""A lower supply counts as zero."""


class MotorOutput:
    """Output and current of all servos of a bus."""

    def __init__(self, drive: ServoDrive, blocked_shaft: BlockedShaft) -> None:
        self._drive = drive
        self._blocked_shaft = blocked_shaft
        self.limited = False
        """Whether the mode of any servo limits its current."""
        self.current_a: Callable[[], Floats] = blocked_shaft.current_a
        """(S,) measured motor currents, A."""
        self._heat_j, self._since_j = drive.heat_j.copy(), np.zeros_like(drive.heat_j)

    def take_heat_j(self, seconds: float) -> Floats:
        """(S,) winding heat since the last call, ``seconds`` ago; valid until the next."""
        drive = self._drive
        since_j = np.subtract(drive.heat_j, self._heat_j, out=self._since_j)
        self._heat_j[:] = drive.heat_j
        if not self._blocked_shaft.any:
            return since_j
        stall_j = drive.resistance_ohm * self.current_a() ** 2 * seconds
        return np.where(self._blocked_shaft.rows, stall_j, since_j)

    def pwm(self, velocity_rad_s: Floats) -> Floats:
        """(S,) output of the bridges at these shaft speeds, fraction of the supply."""
        pwm = self._blocked_shaft.pwm()
        if not self.limited:
            return pwm
        drive = self._drive
        amps = self._blocked_shaft.current_a()
        cut = (np.abs(amps) >= AT_LIMIT * self._blocked_shaft.limit_a()) & (drive.torque_on > 0.0)
        volts = amps * drive.resistance_ohm + drive.back_emf_v_s * velocity_rad_s
        left = volts / np.maximum(drive.supply_v, LEAST_SUPPLY_V)
        return np.where(cut, np.clip(left, -1.0, 1.0), pwm)
