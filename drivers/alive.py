"""Whether servos that answer still do as told: torque on, watchdog not tripped.

A servo that rebooted answers as if nothing had happened, with its torque off; one whose watchdog
ran out answers too, and takes no goal. Neither shows in what the cycle reads.
"""

from collections.abc import Sequence

from drivers.bus import DynamixelBus
from drivers.errors import BusError
from drivers.types import Bools

WATCHDOG_TRIPPED = 0xFF
"""Bus Watchdog(98) reads -1 in its error state (e-manual)."""


class AliveCheck:
    """Two one-byte group reads, each a small part of a cycle's wire time."""

    def __init__(self, bus: DynamixelBus, servo_ids: Sequence[int], *, fast: bool) -> None:
        self._ids = tuple(servo_ids)
        self._torque = bus.block(servo_ids, "Torque Enable", "Torque Enable", fast=fast)
        self._watchdog = bus.block(servo_ids, "Bus Watchdog", "Bus Watchdog", fast=fast)

    def torque(self) -> None:
        """Check that torque is on; servos that do not answer are not judged.

        Raises:
            BusError: torque is off.
            PortError: the port is gone.

        """
        answer = self._torque.read()
        self._complain(answer.valid & (answer.data[:, 0] == 0), "torque is off: has it rebooted?")

    def watchdog(self) -> None:
        """Check that no watchdog has run out; servos that do not answer are not judged.

        Raises:
            BusError: one has.
            PortError: the port is gone.

        """
        answer = self._watchdog.read()
        tripped = answer.valid & (answer.data[:, 0] == WATCHDOG_TRIPPED)
        self._complain(tripped, "its bus watchdog has stopped it")

    def _complain(self, bad: Bools, what: str) -> None:
        if bad.any():
            which = ", ".join(str(i) for i, b in zip(self._ids, bad, strict=True) if b)
            raise BusError(f"servo {which}: {what}")
