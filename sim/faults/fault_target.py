"""What a line has to offer for a fault file to act on it; those of both protocols do."""

from collections.abc import Collection, Mapping
from typing import Protocol

from snakewalk.config.arrays import Indices
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.noise import FaultScript
from snakewalk.sim.servo.event_queue import EventQueue


class Guard(Protocol):
    """Supply, heat and alarms of some servos."""

    def alarms(self, row: int) -> Mapping[str, int]:
        """What a servo can detect, by kind of fault, and its bit."""
        ...

    def supply(self, volts: float | None, rows: Indices | None = None) -> None:
        """Another supply of all or of ``rows``; None: the usual one again."""
        ...

    def heat(self, rows: Indices, celsius: float) -> None:
        """Set housings to a temperature."""
        ...

    def detect(self, rows: Indices, error: int) -> None:
        """Let servos find an error."""
        ...


class FaultyServos(Protocol):
    """The servos of a line; a row is a place along the chain."""

    @property
    def events(self) -> EventQueue:
        """What happens to them at a time of its own."""
        ...

    @property
    def protection(self) -> Guard:
        """What they guard themselves against."""
        ...

    def block_shafts(self, rows: Indices) -> None:
        """Block shafts where they are."""
        ...

    def free_shafts(self, rows: Indices) -> None:
        """Free blocked shafts."""
        ...

    def cut_power(self, rows: Indices) -> None:
        """Take the supply away."""
        ...

    def restore_power(self, rows: Indices) -> None:
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

    def senders(self, answer: bytes) -> Collection[int]:
        """IDs of the servos that have written an answer."""
        ...

    def rename(self, row: int, servo_id: int) -> None:
        """Give a servo another ID."""
        ...

    def mute(self, rows: Indices, on: bool) -> None:
        """Let servos fall silent, or speak again."""
        ...

    def refresh_ids(self) -> None:
        """Look up again who has which ID, after IDs, power or muting have changed."""
        ...

    def disconnect(self) -> None:
        """Take the port away."""
        ...

    def reconnect(self) -> None:
        """Give the port back."""
        ...

    def attach(self, script: FaultScript) -> None:
        """Let a script act on packets and host."""
        ...
