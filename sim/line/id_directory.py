"""The ID directory: servos that an ID reaches, and those that reply to it."""

from collections import defaultdict

import numpy as np

from snakewalk.config.arrays import Bools
from snakewalk.sim.servo.bank import ServoBank

NOBODY = -1
SPECIAL = -2
"""Entries of ``IdDirectory.rows`` that are not rows."""
_SECONDARY_OFF = 253
"""Secondary(Shadow) ID(12) from here on means none (e-manual)."""


class IdDirectory:
    """The powered servos at the line's baud rate, by primary and secondary ID."""

    def __init__(self, bank: ServoBank) -> None:
        self._bank = bank
        self.mute = np.zeros(len(bank), bool)
        """(S,) servos that receive and obey but whose replies are lost."""
        self.deaf = np.zeros(len(bank), bool)
        """(S,) whether a servo ignores sync writes."""
        self.rows = np.full(256, NOBODY, np.intp)
        """(256,) row of each ID that belongs to one servo, which replies; else a constant above."""
        self._looked_up = b""
        self._first: dict[int, list[int]] = {}
        self._second: dict[int, list[int]] = {}

    def refresh(self, baud: int, powered: Bools) -> None:
        """Look the servos up again after a change of IDs, baud rates or power."""
        bank = self._bank
        columns = (bank["ID"], bank["Secondary(Shadow) ID"], bank["Baud Rate"], powered, self.mute)
        now = baud.to_bytes(4, "little") + b"".join(column.tobytes() for column in columns)
        if now == self._looked_up:
            return
        self._looked_up = now
        first = defaultdict(list)
        second = defaultdict(list)
        for row in bank.tuned_to(baud):
            if not powered[row]:
                continue
            servo_id = int(bank["ID"][row])
            shared = int(bank["Secondary(Shadow) ID"][row])
            first[servo_id].append(int(row))
            if shared < _SECONDARY_OFF and shared != servo_id:
                second[shared].append(int(row))
        self._first, self._second = dict(first), dict(second)
        self.rows[:] = NOBODY
        for bus_id, rows in first.items():
            plain = len(rows) == 1 and bus_id not in second and not self.mute[rows[0]]
            self.rows[bus_id] = rows[0] if plain else SPECIAL
        for second_id in second:
            self.rows[second_id] = SPECIAL

    def present(self) -> list[int]:
        """Rows of all receiving servos."""
        return sorted(row for rows in self._first.values() for row in rows)

    def ids(self) -> list[int]:
        """Primary IDs in use, ascending."""
        return sorted(self._first)

    def primary(self, servo_id: int) -> list[int]:
        """Rows of the servos with this ID; several if IDs clash."""
        return self._first.get(servo_id, [])

    def secondary(self, servo_id: int) -> list[int]:
        """Rows of the servos with this secondary ID: they obey, and never reply."""
        return self._second.get(servo_id, [])

    def replying(self, servo_id: int) -> list[int]:
        """Rows that reply to this ID."""
        return [row for row in self.primary(servo_id) if not self.mute[row]]
