"""What a line has to offer for a fault file to act on it; those of both protocols do."""

from collections.abc import Collection, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.bus.agenda import Agenda
from sim.bus.clock import SimClock
from sim.bus.noise import Script

Rows = NDArray[np.intp]


class Guard(Protocol):
    """Supply, heat and alarms of some servos."""

    def alarms(self, row: int) -> Mapping[str, int]:
        """What a servo can detect, by kind of fault, and its bit."""
        ...

    def supply(self, volts: float | None, rows: Rows | None = None) -> None:
        """Another supply of all or of ``rows``; None: the usual one again."""
        ...

    def heat(self, rows: Rows, celsius: float) -> None:
        """Set housings to a temperature."""
        ...

    def detect(self, rows: Rows, error: int) -> None:
        """Let servos find an error."""
        ...


class FaultyServos(Protocol):
    """The servos of a line; a row is a place along the chain."""

    @property
    def agenda(self) -> Agenda:
        """What happens to them at a time of its own."""
        ...

    @property
    def protection(self) -> Guard:
        """What they guard themselves against."""
        ...

    def seize(self, rows: Rows) -> None:
        """Jam shafts where they are."""
        ...

    def release(self, rows: Rows) -> None:
        """Free jammed shafts."""
        ...

    def cut_power(self, rows: Rows) -> None:
        """Take the supply away."""
        ...

    def give_power(self, rows: Rows) -> None:
        """Give it back; the servos start anew."""
        ...

    def reboot(self, row: int) -> None:
        """Restart one servo."""
        ...


class FaultTarget(Protocol):
    """A line and the servos on it."""

    clock: SimClock

    @property
    def servos(self) -> FaultyServos:
        """Those on the line."""
        ...

    def ids(self) -> list[int]:
        """The ID of each row."""
        ...

    def speakers(self, answer: bytes) -> Collection[int]:
        """IDs of the servos that have written an answer."""
        ...

    def rename(self, row: int, servo_id: int) -> None:
        """Give a servo another ID."""
        ...

    def mute(self, rows: Rows, on: bool) -> None:
        """Let servos fall silent, or speak again."""
        ...

    def look_again(self) -> None:
        """Take note that IDs, power or voices have changed."""
        ...

    def vanish(self) -> None:
        """Take the port away."""
        ...

    def come_back(self) -> None:
        """Give the port back."""
        ...

    def attach(self, script: Script) -> None:
        """Let a script act on packets and host."""
        ...
