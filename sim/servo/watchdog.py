"""Bus Watchdog(98): a servo without packets for its time stops at its angle.

While torque is on, any instruction packet feeds the watchdogs of all servos. An expired watchdog
reads -1 until 0 is written. (e-manual, Bus Watchdog.)
"""

import numpy as np

from snakewalk.config.arrays import Bools
from snakewalk.drivers.protocol.registers import WATCHDOG_TRIPPED, WATCHDOG_UNIT_S
from snakewalk.sim.servo.bank import ServoBank

ROUNDING_S = 1e-9
"""Times closer than this are the same."""


class Watchdog:
    """The watchdogs of all servos of a bank, fed until ``time_s``."""

    def __init__(self, bank: ServoBank, time_s: float) -> None:
        self._bank = bank
        self.fed_s = time_s
        """When they were last fed."""
        self.timeout_s = np.inf
        """How long the most impatient of them waits."""
        self._watched = np.zeros(len(bank), bool)
        self.due_s = np.inf
        """When the first of them runs out."""

    def arm(self, on: Bools) -> None:
        """Read the register; ``on`` (S,) marks servos with torque."""
        dog = self._bank["Bus Watchdog"]
        self._watched = (dog > 0) & (dog < WATCHDOG_TRIPPED) & on
        watched = self._watched
        self.timeout_s = WATCHDOG_UNIT_S * float(dog[watched].min()) if watched.any() else np.inf
        self.due_s = self.fed_s + self.timeout_s

    def trip(self, time_s: float) -> Bools:
        """Put those expired by ``time_s`` into the error state; return them (S,)."""
        dog = self._bank["Bus Watchdog"]
        late = self._watched & (self.fed_s + WATCHDOG_UNIT_S * dog <= time_s + ROUNDING_S)
        dog[late] = WATCHDOG_TRIPPED
        return late
