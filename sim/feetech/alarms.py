"""Alarms of a Feetech servo: load, heat, supply, encoder.

An alarm is a bit of the servo status (register 65) and of the error byte of every reply while its
cause lasts. Alarms in the mask of Shutdown(19) stay until torque is switched on again. Heat, supply
and encoder switch it off; an overload lowers the output to Protective Torque(34). (Memory tables of
STS, SCSCL and HLS; the end of an alarm is ours.)
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.protocol.feetech import FeetechAlarm
from snakewalk.sim.ax12.alarms import Ax12Alarms
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.blocked_shaft import BlockedShaft
from snakewalk.sim.servo.motor import MotorModel

ALARMS: Mapping[str, int] = {
    "overload": FeetechAlarm.OVERLOAD,
    "overheating": FeetechAlarm.OVERHEATING,
    "voltage": FeetechAlarm.VOLTAGE,
    "encoder": FeetechAlarm.ENCODER,
}
"""By the words of a fault file."""
_TIME_UNIT_S = 0.01


class FeetechAlarms(Ax12Alarms):
    """Alarms of S servos of one model, whose registers are ``register(name)`` (S,)."""

    def __init__(
        self,
        register: Callable[[str], NDArray[np.int64]],
        kinds: Sequence[str],
        drive: ServoDrive,
        motor: MotorModel,
        blocked_shaft: BlockedShaft,
        supply_v: float,
    ) -> None:
        """Set up servos without an alarm; they detect those of ``kinds``."""
        super().__init__(register, drive, motor, blocked_shaft, supply_v)  # type: ignore[arg-type]
        self.known = {kind: bit for kind, bit in ALARMS.items() if kind in kinds}

    @property
    def is_weak(self) -> Bools:
        """(S,) whether an overload has lowered the output."""
        return np.asarray((self._latched & FeetechAlarm.OVERLOAD) != 0)

    def _full_output(self) -> Floats:
        if "overload" not in self.known:
            return np.full(len(self.shown), np.inf)
        return np.asarray(self._register("Overload Torque") / 100.0)

    def _overload_s(self) -> Floats | float:
        if "overload" not in self.known:
            return np.inf
        return np.asarray(self._register("Protection Time") * _TIME_UNIT_S)

    def _shut_down(self) -> None:
        self.shown |= self._latched
        off = self._latched & self._register("Shutdown") & ~FeetechAlarm.OVERLOAD
        self._register("Torque Enable")[off != 0] = 0
