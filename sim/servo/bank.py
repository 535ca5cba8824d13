"""The control tables of all servos of a bus as one array, and the rules for reading and writing.

A register is a live, typed view over all servos at once, so a group read or write is one slice.
What registers *do* (drive the motor, show the shaft, run the watchdog) is ``sim.servo.firmware``.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Indices, SignedInts
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import Register
from snakewalk.drivers.protocol.packet import ALERT, ResultError
from snakewalk.drivers.protocol.registers import (
    BAUDS,
    CURRENT_MODES,
    MODES,
    POSITION_MODE,
    VELOCITY_MODE,
    WATCHDOG_TRIPPED,
)
from snakewalk.sim.servo.indirect import Indirect
from snakewalk.sim.servo.register_rules import (
    EEPROM_END,
    GOALS,
    MODE_RESETS,
    indirect_blocks,
    registers_of,
)

TABLE_BYTES = 1024


class ServoBank:
    """S servos of one model, factory new but for ID and baud rate.

    ``clashing`` allows two servos to share an ID, as an unlucky chain does. ``table`` is (S, bytes)
    of a greater array that they are a part of (``sim.bus.mixed``).

    Raises:
        ControlTableError: the model cannot be simulated, an ID is out of range or used twice, or
            the baud rate is not one of the model's.

    """

    def __init__(
        self,
        ids: Sequence[int],
        model: str = "XM430-W350",
        baud: int = 1_000_000,
        *,
        clashing: bool = False,
        table: NDArray[np.uint8] | None = None,
    ) -> None:
        self.ids = tuple(ids)
        self.layout, self._registers, self._rules = registers_of(model.upper().replace("_", "-"))
        self.model = self.layout.model
        known = BAUDS[: (self._rules["Baud Rate"].high or 0) + 1]
        faults = [f"ID {each}: a servo has 0 to 252" for each in self.ids if not 0 <= each <= 252]
        if len(set(self.ids)) != len(self.ids) and not clashing:
            faults.append(f"two servos share an ID: {', '.join(map(str, sorted(self.ids)))}")
        if baud not in known:
            faults.append(f"{baud} baud: {self.model} has {', '.join(map(str, known))}")
        if faults:
            raise ControlTableError(faults)
        self.table = table if table is not None else np.zeros((len(ids), TABLE_BYTES), np.uint8)
        self._views = {name: self._view(name) for name in self._rules}
        self._spans = {
            register.address: (register, self._rules[name])
            for name, register in self._registers.items()
        }
        self.indirect = Indirect(self.table, indirect_blocks(self.layout))
        self.measures_current = "Present Current" in self._rules
        self._registered: dict[int, tuple[int, bytes]] = {}
        self._backup: dict[int, bytes] = {}
        self.reset(np.arange(len(self.ids)), keep=())
        self["ID"][:] = self.ids
        self["Baud Rate"][:] = BAUDS.index(baud)

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, name: str) -> SignedInts:
        """(S,) live view of a register of all servos, by the SDK's name."""
        return self._views[name]

    def __contains__(self, name: object) -> bool:
        return name in self._views

    def register(self, name: str) -> Register:
        """Address, size and sign of a register, also of those that the SDK's table lacks."""
        return self._registers[name]

    def names(self) -> tuple[str, ...]:
        """All registers of the model."""
        return tuple(self._registers)

    def tuned_to(self, baud: int) -> Indices:
        """Rows of the servos that are tuned to ``baud``."""
        index = BAUDS.index(baud) if baud in BAUDS else -1
        return np.flatnonzero(self["Baud Rate"] == index)

    def alert(self, rows: Indices | slice | int) -> NDArray[np.uint8]:
        """Bit 7 of the error field: set while Hardware Error Status(70) is not 0."""
        wrong = self["Hardware Error Status"][rows] != 0
        alert: NDArray[np.uint8] = np.multiply(wrong, ALERT, dtype=np.uint8)
        return alert

    def shut_down(self, row: int) -> bool:
        """Whether a hardware error of Shutdown(63) holds the torque off until a reboot."""
        return bool(self["Hardware Error Status"][row] & self["Shutdown"][row])

    def readable(self, address: int, length: int) -> bool:
        """Whether a block lies in the table; gaps between registers read as 0."""
        return length > 0 and address >= 0 and address + length <= TABLE_BYTES

    def check(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """Say what a write of ``data`` would answer; nothing is written.

        ``ram_only`` refuses the EEPROM, as a servo does that is addressed by its secondary ID.
        """
        if not data:
            return ResultError.DATA_LENGTH
        for start, run in self.indirect.runs(row, address, data):
            at = start
            while at < start + len(run):
                span = self._spans.get(at)
                if span is None:
                    return ResultError.ACCESS
                register, rule = span
                end = at + register.size
                if end > start + len(run):
                    return ResultError.DATA_LENGTH
                locked = at < EEPROM_END and (ram_only or self["Torque Enable"][row])
                if not rule.writable or locked:
                    return ResultError.ACCESS
                error = self._check_value(
                    row, register.name, register.decode(run[at - start : end - start])
                )
                if error:
                    return error
                at = end
        return ResultError.NONE

    def write(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """Write a block to one servo, all of it or, with an error, none of it."""
        error = self.check(row, address, data, ram_only=ram_only)
        if not error:
            for at, run in self.indirect.runs(row, address, data):
                self.table[row, at : at + len(run)] = np.frombuffer(run, np.uint8)
            self.indirect.written(address, len(data))
        return error

    def register_write(
        self, row: int, address: int, data: bytes, *, ram_only: bool = False
    ) -> ResultError:
        """Reg Write: check as ``write`` does, and keep for Action."""
        error = self.check(row, address, data, ram_only=ram_only)
        if not error:
            self._registered[row] = (address, data)
            self["Registered Instruction"][row] = 1
        return error

    def registered(self, row: int) -> tuple[int, bytes] | None:
        """Take out what was registered, address and data; None if nothing was."""
        self["Registered Instruction"][row] = 0
        return self._registered.pop(row, None)

    def reset(self, rows: Indices, keep: Sequence[str], ram_only: bool = False) -> None:
        """Set initial values, in the RAM area alone (reboot) or in both (factory reset)."""
        for name, rule in self._rules.items():
            if name not in keep and not (ram_only and self.register(name).address < EEPROM_END):
                self[name][rows] = rule.initial
        for goal in GOALS[:3]:
            if goal in self:
                self[goal][rows] = self[_limit_of(goal)][rows]
        self._stand_still(rows)
        for row in rows:
            self._registered.pop(int(row), None)
            self["Backup Ready"][row] = int(row) in self._backup
        self.indirect.look()

    def back_up(self, row: int) -> ResultError:
        """Store the EEPROM and the saved part of the RAM; only with torque off (e-manual)."""
        if self["Torque Enable"][row]:
            return ResultError.RESULT_FAIL
        self._backup[row] = self.table[row].tobytes()
        self["Backup Ready"][row] = 1
        return ResultError.NONE

    def restore(self, row: int) -> ResultError:
        """Put the stored EEPROM back; the servo then reboots."""
        if self["Torque Enable"][row] or row not in self._backup:
            return ResultError.RESULT_FAIL
        self.table[row, :EEPROM_END] = np.frombuffer(self._backup[row], np.uint8)[:EEPROM_END]
        return ResultError.NONE

    def restore_ram(self, row: int) -> None:
        """Put the stored gains, profile and indirect addresses back (RAM Restore, at start)."""
        kept = self._backup.get(row)
        if kept is None:
            return
        stored = np.frombuffer(kept, np.uint8)
        names = [*MODE_RESETS, *(n for n in self._rules if n.startswith("Indirect Address"))]
        for name in names:
            register = self.register(name)
            block = slice(register.address, register.address + register.size)
            self.table[row, block] = stored[block]
        self.indirect.look()

    def switch_mode(self, rows: Indices) -> None:
        """Set back what a new Operating Mode(11) does: gains, profile, and limits of the output."""
        for name in MODE_RESETS:
            self[name][rows] = self._rules[name].initial
        for goal in ("Goal PWM", "Goal Current"):
            if goal in self:
                self[goal][rows] = self[_limit_of(goal)][rows]
        self._stand_still(rows)

    def _stand_still(self, rows: Indices) -> None:
        """Torque on alone turns nothing (e-manual, Bus Watchdog(98), example, steps 1 and 2)."""
        turning = rows[self["Operating Mode"][rows] == VELOCITY_MODE]
        self["Goal Velocity"][turning] = 0

    def _check_value(self, row: int, name: str, value: int) -> ResultError:
        rule = self._rules[name]
        if rule.low is not None and rule.high is not None and not rule.low <= value <= rule.high:
            return ResultError.DATA_RANGE
        if name == "Operating Mode" and not self._has_mode(value):
            return ResultError.DATA_RANGE
        if name == "Torque Enable" and value and self.shut_down(row):
            return ResultError.RESULT_FAIL
        if name in GOALS:
            if self["Bus Watchdog"][row] == WATCHDOG_TRIPPED:
                return ResultError.DATA_RANGE
            low, high = self.goal_limits(name, row)
            if not low <= value <= high:
                return ResultError.DATA_LIMIT
        return ResultError.NONE

    def goal_limits(self, name: str, row: int) -> tuple[int, int]:
        """Least and greatest value that a goal register takes now."""
        if name == "Goal Position":
            if self["Operating Mode"][row] == POSITION_MODE:
                return int(self["Min Position Limit"][row]), int(self["Max Position Limit"][row])
            rule = self._rules[name]
            return int(rule.low or 0), int(rule.high or 0)
        limit = int(self[_limit_of(name)][row])
        return -limit, limit

    def _has_mode(self, mode: int) -> bool:
        return mode in MODES and (self.measures_current or mode not in CURRENT_MODES)

    def _view(self, name: str) -> SignedInts:
        field = self.register(name)
        kind = f"<{'i' if field.signed else 'u'}{field.size}"
        block = self.table[:, field.address : field.address + field.size]
        return block.view(kind)[:, 0]


def _limit_of(goal: str) -> str:
    return goal.removeprefix("Goal ") + " Limit"
