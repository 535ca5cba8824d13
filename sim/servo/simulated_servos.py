"""Base of simulated servos on one plant: supply, blocked shafts, constant readings, time."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.config.errors import InputError
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.blocked_shaft import BlockedShaft
from snakewalk.sim.servo.constant_readings import ConstantReadings
from snakewalk.sim.servo.event_queue import EventQueue

SLICE_S = 2e-3
"""Longest step between two updates of drives and alarms (ours)."""


class FaultyProtection(Protocol):
    """Supply, heat and alarms of some servos."""

    def alarms(self, row: int) -> Mapping[str, int]:
        """Errors that a servo can detect, by kind of fault, and their bits."""
        ...

    def supply(self, volts: float | None, rows: Indices | None = None) -> None:
        """Set the supply of all servos, or of ``rows``; None: the usual voltage."""
        ...

    def heat(self, rows: Indices, celsius: float) -> None:
        """Set housing temperatures."""
        ...

    def detect(self, rows: Indices, error: int) -> None:
        """Raise an error of some servos."""
        ...


class ServoAlarms(FaultyProtection, Protocol):
    """Heat and alarms of the servos."""

    def check(self, seconds: float, velocity_rad_s: Floats) -> None:
        """Update heat and alarms after ``seconds``."""


def check_ids(ids: Sequence[int], model: str, most: int) -> None:
    """Check the IDs of new servos.

    Raises:
        InputError: an ID is outside 0 to ``most`` or used twice.

    """
    wrong = [
        f"ID {servo_id}: an {model} has 0 to {most}"
        for servo_id in ids
        if not 0 <= servo_id <= most
    ]
    if len(set(ids)) != len(ids):
        wrong.append(f"two servos share an ID: {', '.join(map(str, sorted(ids)))}")
    if wrong:
        raise InputError(wrong)


class FaultyServos(ABC):
    """S servos that fault files change."""

    plant: Plant
    events: EventQueue
    """Events that happen to the servos at a time of their own, such as faults."""
    protection: FaultyProtection
    blocked_shaft: BlockedShaft
    powered: Bools
    """(S,) whether a servo has a supply; without one it receives nothing, and its shaft is limp."""
    no_output: Bools
    """(S,) whether the output stage is dead: registers show a servo that works."""
    _readings: ConstantReadings

    @abstractmethod
    def refresh(self) -> None:
        """Write all present values into the registers."""

    @abstractmethod
    def reboot(self, row: int) -> None:
        """Restart one servo."""

    @abstractmethod
    def restore_power(self, rows: Indices) -> None:
        """Restore the supply; the servos restart."""

    def apply_registers(self) -> None:  # noqa: B027  not all servos store what registers mean
        """Let changed registers and faults act."""

    def cut_power(self, rows: Indices) -> None:
        """Switch the supply off: shafts go limp, only the EEPROM remains."""
        self.powered[rows] = False
        self.apply_registers()

    def block_shafts(self, rows: Indices) -> None:
        """Block shafts where they are."""
        for row in rows:
            self.blocked_shaft.block(int(row), float(self.plant.position_rad[row]))
        self.apply_registers()

    def free_shafts(self, rows: Indices) -> None:
        """Free blocked shafts."""
        for row in rows:
            self.blocked_shaft.free(int(row))
        self.apply_registers()

    def cut_output(self, rows: Indices, on: bool) -> None:
        """Disconnect output stages from their motors, or reconnect them."""
        self.no_output[rows] = on
        self.apply_registers()

    def set_reading(self, rows: Indices, name: str, value: int | None) -> None:
        """Let servos report a constant value in a register; None: the present one."""
        self.refresh()
        self._readings.set(rows, name, value)

    def clear_reading(self, rows: Indices, name: str) -> None:
        """Let servos report measured values in a register again."""
        self._readings.clear(rows, name)


class SimulatedServos(FaultyServos):
    """S servos whose registers drive the shafts of a plant."""

    protection: ServoAlarms

    def __init__(self, plant: Plant, drive: ServoDrive) -> None:
        """Set up supply and time; subclasses set up registers."""
        servos = len(drive.torque_on)
        self.plant = plant
        self.drive = drive
        self.blocked_shaft = BlockedShaft(drive)
        self.events = EventQueue()
        self.powered = np.ones(servos, bool)
        self.no_output = np.zeros(servos, bool)
        self._readings = ConstantReadings(self.__getitem__)
        self._registered: dict[int, tuple[int, bytes]] = {}
        self._time_s = plant.time_s

    @abstractmethod
    def __getitem__(self, name: str) -> NDArray[np.integer[Any]]:
        """(S,) live view of a register."""

    @abstractmethod
    def _update_drive(self, seconds: float) -> None:
        """Let the registers drive the motors for ``seconds``."""

    def _torque_is_on(self) -> Bools:
        return np.asarray((self["Torque Enable"] == 1) & self.powered)

    def __len__(self) -> int:
        return len(self.powered)

    def restore_power(self, rows: Indices) -> None:
        """Restore the supply."""
        self.powered[rows] = True
        for row in rows:
            self.reboot(int(row))

    def advance(self, until_s: float) -> None:
        """Step physics, trajectories and alarms to ``until_s``."""
        while self._time_s < until_s:
            stop_s = min(until_s, self._time_s + SLICE_S, self.events.next_s)
            if stop_s > self._time_s:
                self._update_drive(stop_s - self._time_s)
                self.plant.advance(stop_s, self.drive)
                self.protection.check(stop_s - self._time_s, self.plant.velocity_rad_s)
                self._time_s = stop_s
            if stop_s >= self.events.next_s:
                self.events.run_due(stop_s)
