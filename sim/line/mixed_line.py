"""Servos of several models on one wire: a firmware for each part of the chain, one line for all."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Indices
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import Plant
from snakewalk.sim.servo.bank import TABLE_BYTES
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.event_queue import EventQueue
from snakewalk.sim.servo.firmware import Firmware
from snakewalk.sim.servo.mixed_bank import MixedBank
from snakewalk.sim.servo.protection import Protection, SupplyAndAmbient

_ENTRY = 5
"""Bytes of one servo's goal in a sync write: ID and value."""


class MixedProtection(Protection):
    """What is done to the supply and the housings of all parts from outside."""

    def __init__(self, bank: MixedBank, parts: Sequence[Protection]) -> None:
        self._mix, self._parts = bank, tuple(parts)

    def alarms(self, row: int) -> Mapping[str, int]:
        """As ``Protection.alarms``, by the servo's model."""
        return self._parts[self._mix.part_of(row)].alarms(row)

    def supply(self, volts: float | None, rows: Indices | None = None) -> None:
        """As ``Protection.supply``, each part with its own usual voltage."""
        if rows is None:
            for part in self._parts:
                part.supply(volts)
            return
        for k, own in self._mix.split(rows):
            self._parts[k].supply(volts, own)

    def heat(self, rows: Indices, celsius: float) -> None:
        """As ``Protection.heat``."""
        for part, own in self._mix.split(rows):
            self._parts[part].heat(own, celsius)

    def detect(self, rows: Indices, error: int) -> None:
        """As ``Protection.detect``."""
        for part, own in self._mix.split(rows):
            self._parts[part].detect(own, error)


class MixedFirmware(Firmware):
    """Firmware of every part of ``bank``, each on its own plant; rows are those of the chain."""

    def __init__(
        self, bank: MixedBank, plants: Sequence[Plant], around: SupplyAndAmbient | None = None
    ) -> None:
        self.bank: MixedBank = bank
        self.parts = tuple(
            Firmware(own, plant, around) for own, plant in zip(bank.parts, plants, strict=True)
        )
        self.protection = MixedProtection(bank, [part.protection for part in self.parts])
        self.events = EventQueue()
        self.powered = np.ones(len(bank), bool)
        bounds = [*bank.starts[1:], len(bank)]
        for part, low, high in zip(self.parts, bank.starts, bounds, strict=True):
            part.powered = self.powered[low:high]

    def advance(self, until_s: float) -> None:
        """As ``Firmware.advance``, all parts in step wherever something is planned."""
        while self.events.next_s <= until_s:
            due_s = self.events.next_s
            for part in self.parts:
                part.advance(due_s)
            self.events.run_due(due_s)
            self.apply_registers()
        for part in self.parts:
            part.advance(until_s)

    def on_instruction(self, time_s: float) -> None:
        """As ``Firmware.heard``: a packet is heard along the whole chain."""
        for part in self.parts:
            part.on_instruction(time_s)

    def apply_registers(self) -> None:
        """As ``Firmware.changed``."""
        for part in self.parts:
            part.apply_registers()

    def write_goals(self, rows: Indices, raw: NDArray[np.uint8], at: int) -> None:
        """As ``Firmware.write_goals``, each part with its own entries."""
        which = np.searchsorted(self.bank.starts, rows, "right") - 1
        entries = raw[at : at + _ENTRY * len(rows)].reshape(-1, _ENTRY)
        for part, own in self.bank.split(rows):
            mine = np.ascontiguousarray(entries[which == part]).ravel()
            self.parts[part].write_goals(own, mine, 0)

    def enable_by_goal(self, rows: Indices) -> None:
        """As ``Firmware.wake``."""
        for part, own in self.bank.split(rows):
            self.parts[part].enable_by_goal(own)

    def reboot(self, row: int, factory_keeping: tuple[str, ...] | None = None) -> None:
        """As ``Firmware.reboot``."""
        part, own = self._own(row)
        part.reboot(own, factory_keeping)

    def power_up(self, rows: Indices) -> None:
        """As ``Firmware.power_up``."""
        for part, own in self.bank.split(rows):
            self.parts[part].power_up(own)

    def clear_turns(self, row: int) -> bool:
        """As ``Firmware.clear_turns``."""
        part, own = self._own(row)
        return part.clear_turns(own)

    def clear_error(self, row: int) -> bool:
        """As ``Firmware.clear_error``."""
        part, own = self._own(row)
        return part.clear_error(own)

    def block_shafts(self, rows: Indices) -> None:
        """As ``Firmware.seize``."""
        for part, own in self.bank.split(rows):
            self.parts[part].block_shafts(own)

    def free_shafts(self, rows: Indices) -> None:
        """As ``Firmware.release``."""
        for part, own in self.bank.split(rows):
            self.parts[part].free_shafts(own)

    def cut_power(self, rows: Indices) -> None:
        """As ``Firmware.cut_power``."""
        for part, own in self.bank.split(rows):
            self.parts[part].cut_power(own)

    def restore_power(self, rows: Indices) -> None:
        """As ``Firmware.restore_power``."""
        for part, own in self.bank.split(rows):
            self.parts[part].restore_power(own)

    def refresh_motion(self) -> None:
        """As ``Firmware.refresh_motion``."""
        for part in self.parts:
            part.refresh_motion()

    def refresh(self, address: int = 0, length: int = TABLE_BYTES) -> None:
        """As ``Firmware.refresh``."""
        for part in self.parts:
            part.refresh(address, length)

    def _own(self, row: int) -> tuple[Firmware, int]:
        part = self.bank.part_of(row)
        return self.parts[part], row - int(self.bank.starts[part])


class MixedLine(SimLine):
    """Servos of several models on benches of their own behind one serial line of ``baud``.

    ``benches`` are the plants of the bank's parts, in their order.
    """

    def __init__(
        self,
        bank: MixedBank,
        benches: Sequence[BenchPlant],
        clock: SimClock | None = None,
        baud: int = 1_000_000,
    ) -> None:
        self._benches = tuple(benches)
        super().__init__(bank, self._benches[0], clock, baud)

    def _firmware(
        self, bank: object, plant: Plant, supply_and_ambient: SupplyAndAmbient | None
    ) -> MixedFirmware:
        del plant  # the first of the benches
        assert isinstance(bank, MixedBank)
        return MixedFirmware(bank, self._benches, supply_and_ambient)
