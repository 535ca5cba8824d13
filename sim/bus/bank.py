"""The control tables of all servos of a bus as one array, and the rules for reading and writing.

A register is a live, typed view over all servos at once, so a group read or write is one slice.
What registers *do* (drive the motor, show the shaft, run the watchdog) is ``sim.bus.firmware``.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.control_table import ControlTable, load_control_table
from drivers.protocol.packet import ALERT, ResultError
from sim.bus.registers import (
    BAUDS,
    EEPROM_END,
    GOALS,
    MODE_RESETS,
    MODES,
    POSITION_MODE,
    WATCHDOG_TRIPPED,
    Rule,
    rules,
)

Rows = NDArray[np.intp]
Ints = NDArray[np.signedinteger]

TABLE_BYTES = 1024


class ServoBank:
    """S servos of one model with distinct IDs, factory new but for ID and baud rate.

    Raises:
        ControlTableError: the model is unknown, or cannot be simulated.
        ValueError: an ID is used twice, or the baud rate is not one of the servos'.

    """

    def __init__(
        self, ids: Sequence[int], model: str = "XM430-W350", baud: int = 1_000_000
    ) -> None:
        if len(set(ids)) != len(ids):
            raise ValueError(f"two servos share an ID: {sorted(ids)}")
        if baud not in BAUDS:
            raise ValueError(f"{baud} baud: the servos have {', '.join(map(str, BAUDS))}")
        self.ids = tuple(ids)
        self.layout = load_control_table(model)
        self.model = self.layout.model
        self._rules = {
            name: rule for name, rule in rules(self.model).items() if name in self.layout
        }
        self.table = np.zeros((len(self.ids), TABLE_BYTES), np.uint8)
        self._views = {name: self._view(name) for name in self._rules}
        self._spans = _spans(self.layout, self._rules)
        self._registered: dict[int, tuple[int, bytes]] = {}
        self.reset(np.arange(len(self.ids)), keep=())
        self["ID"][:] = self.ids
        self["Baud Rate"][:] = BAUDS.index(baud)

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, name: str) -> Ints:
        """(S,) live view of a register of all servos, by the SDK's name."""
        return self._views[name]

    def rows_at(self, baud: int) -> Rows:
        """(256,) row of each ID among the servos that listen at ``baud``; -1: nobody."""
        rows = np.full(256, -1, np.intp)
        index = BAUDS.index(baud) if baud in BAUDS else -1
        hear = np.flatnonzero(self["Baud Rate"] == index)
        rows[self["ID"][hear]] = hear
        return rows

    def alert(self, rows: Rows | slice | int) -> NDArray[np.uint8]:
        """Bit 7 of the error field: set while Hardware Error Status(70) is not 0."""
        return np.where(self["Hardware Error Status"][rows] != 0, ALERT, 0).astype(np.uint8)

    def shut_down(self, row: int) -> bool:
        """Whether a hardware error of Shutdown(63) holds the torque off until a reboot."""
        return bool(self["Hardware Error Status"][row] & self["Shutdown"][row])

    def readable(self, address: int, length: int) -> bool:
        """Whether a block lies in the table; gaps between registers read as 0."""
        return length > 0 and address >= 0 and address + length <= TABLE_BYTES

    def check(self, row: int, address: int, data: bytes) -> ResultError:
        """Say what a write of ``data`` would answer; nothing is written."""
        at = address
        while at < address + len(data):
            span = self._spans.get(at)
            if span is None:
                return ResultError.ACCESS
            name, size, rule = span
            if at + size > address + len(data):
                return ResultError.DATA_LENGTH
            if not rule.writable or (at < EEPROM_END and self["Torque Enable"][row]):
                return ResultError.ACCESS
            raw = data[at - address : at - address + size]
            value = int.from_bytes(raw, "little", signed=self.layout[name].signed)
            error = self._check_value(row, name, value)
            if error:
                return error
            at += size
        return ResultError.NONE if data else ResultError.DATA_LENGTH

    def write(self, row: int, address: int, data: bytes) -> ResultError:
        """Write a block to one servo, all of it or, with an error, none of it."""
        error = self.check(row, address, data)
        if not error:
            self.table[row, address : address + len(data)] = np.frombuffer(data, np.uint8)
        return error

    def register_write(self, row: int, address: int, data: bytes) -> ResultError:
        """Reg Write: check and keep for Action."""
        error = self.check(row, address, data)
        if not error:
            self._registered[row] = (address, data)
            self["Registered Instruction"][row] = 1
        return error

    def action(self, row: int) -> ResultError:
        """Carry out the registered write; "Action without Reg Write" is an instruction error."""
        kept = self._registered.pop(row, None)
        self["Registered Instruction"][row] = 0
        return self.write(row, *kept) if kept is not None else ResultError.INSTRUCTION

    def reset(self, rows: Rows, keep: Sequence[str], ram_only: bool = False) -> None:
        """Set initial values, in the RAM area alone (reboot) or in both (factory reset)."""
        for name, rule in self._rules.items():
            if name not in keep and not (ram_only and self.layout[name].address < EEPROM_END):
                self[name][rows] = rule.initial
        for goal, limit in zip(
            GOALS[:3], ("PWM Limit", "Current Limit", "Velocity Limit"), strict=True
        ):
            self[goal][rows] = self[limit][rows]
        for row in rows:
            self._registered.pop(int(row), None)

    def switch_mode(self, rows: Rows) -> None:
        """Set back what a new Operating Mode(11) does: gains, profile, and limits of the output."""
        for name in MODE_RESETS:
            self[name][rows] = self._rules[name].initial
        self["Goal PWM"][rows] = self["PWM Limit"][rows]
        self["Goal Current"][rows] = self["Current Limit"][rows]

    def _check_value(self, row: int, name: str, value: int) -> ResultError:
        rule = self._rules[name]
        if rule.low is not None and rule.high is not None and not rule.low <= value <= rule.high:
            return ResultError.DATA_RANGE
        if name == "Operating Mode" and value not in MODES:
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
        limit = int(self[name.removeprefix("Goal ") + " Limit"][row])
        return -limit, limit

    def _view(self, name: str) -> Ints:
        field = self.layout[name]
        kind = f"<{'i' if field.signed else 'u'}{field.size}"
        block = self.table[:, field.address : field.address + field.size]
        return block.view(kind)[:, 0]


def _spans(layout: ControlTable, known: dict[str, Rule]) -> dict[int, tuple[str, int, Rule]]:
    return {layout[name].address: (name, layout[name].size, rule) for name, rule in known.items()}
