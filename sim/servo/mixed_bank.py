"""Control tables of servos of several models on one bus: banks of one model each, on one array.

Registers that all models have lie at the same addresses throughout the X series, so that they are
one view over all servos here, too; whatever depends on the model is asked of the servo's own bank.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Indices
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.packet import ResultError
from snakewalk.sim.servo.bank import TABLE_BYTES, ServoBank


class MixedBank(ServoBank):
    """S servos, ``models`` (S,) of each, factory new but for ID and baud rate.

    A row is a servo's place along the chain. ``parts`` are the banks of consecutive servos of one
    model, their tables parts of ``table``.

    Raises:
        ControlTableError: as ``ServoBank``, or a model lacks the baud rate.

    """

    def __init__(
        self,
        ids: Sequence[int],
        models: Sequence[str],
        baud: int = 1_000_000,
        *,
        clashing: bool = False,
    ) -> None:
        self.ids = tuple(ids)
        if len(set(self.ids)) != len(self.ids) and not clashing:
            shown = ", ".join(map(str, sorted(self.ids)))
            raise ControlTableError(f"two servos share an ID: {shown}")
        self.table = np.zeros((len(self.ids), TABLE_BYTES), np.uint8)
        cuts = [0, *(k for k in range(1, len(models)) if models[k] != models[k - 1]), len(models)]
        self.starts = np.array(cuts[:-1])
        """First row of each part."""
        self.parts = tuple(
            ServoBank(
                self.ids[low:high], models[low], baud, clashing=clashing, table=self.table[low:high]
            )
            for low, high in pairwise(cuts)
        )
        self.model = ", ".join(dict.fromkeys(part.model for part in self.parts))
        self.measures_current = all(part.measures_current for part in self.parts)
        first, *others = self.parts
        shared = [
            name
            for name in first.names()
            if all(name in o and o.register(name) == first.register(name) for o in others)
        ]
        self._registers = {name: first.register(name) for name in shared}
        self._views = {name: self._view(name) for name in shared}

    def part_of(self, row: int) -> int:
        """Index of the part that a row lies in."""
        return int(np.searchsorted(self.starts, row, "right")) - 1

    def split(self, rows: Indices) -> list[tuple[int, Indices]]:
        """Rows as (part, rows within it), parts without any left out."""
        part = np.searchsorted(self.starts, rows, "right") - 1
        return [(int(k), rows[part == k] - self.starts[k]) for k in np.unique(part)]

    def _own(self, row: int) -> tuple[ServoBank, int]:
        part = self.part_of(row)
        return self.parts[part], row - int(self.starts[part])

    def check(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """As ``ServoBank.check``, by the rules of the servo's model."""
        bank, own = self._own(row)
        return bank.check(own, address, data, ram_only=ram_only)

    def write(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """As ``ServoBank.write``, by the rules of the servo's model."""
        bank, own = self._own(row)
        return bank.write(own, address, data, ram_only=ram_only)

    def register_write(
        self, row: int, address: int, data: bytes, *, ram_only: bool = False
    ) -> ResultError:
        """As ``ServoBank.register_write``."""
        bank, own = self._own(row)
        return bank.register_write(own, address, data, ram_only=ram_only)

    def registered(self, row: int) -> tuple[int, bytes] | None:
        """As ``ServoBank.registered``."""
        bank, own = self._own(row)
        return bank.registered(own)

    def reset(self, rows: Indices, keep: Sequence[str], ram_only: bool = False) -> None:
        """As ``ServoBank.reset``, to the initial values of each servo's model."""
        for part, own in self.split(rows):
            self.parts[part].reset(own, keep, ram_only)

    def back_up(self, row: int) -> ResultError:
        """As ``ServoBank.back_up``."""
        bank, own = self._own(row)
        return bank.back_up(own)

    def restore(self, row: int) -> ResultError:
        """As ``ServoBank.restore``."""
        bank, own = self._own(row)
        return bank.restore(own)

    def restore_ram(self, row: int) -> None:
        """As ``ServoBank.restore_ram``."""
        bank, own = self._own(row)
        bank.restore_ram(own)

    def switch_mode(self, rows: Indices) -> None:
        """As ``ServoBank.switch_mode``."""
        for part, own in self.split(rows):
            self.parts[part].switch_mode(own)

    def goal_limits(self, name: str, row: int) -> tuple[int, int]:
        """As ``ServoBank.goal_limits``."""
        bank, own = self._own(row)
        return bank.goal_limits(name, own)
