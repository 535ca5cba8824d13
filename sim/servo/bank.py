"""The control tables of all servos of a bus as one array, and the rules of access.

A register is a live, typed view over all servos, so a group read or write is one slice.
``sim.servo.firmware`` has the effects of registers.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bytes, Floats, Indices, SignedInts
from snakewalk.config.servo_model import TABLE_BYTES, ServoModel
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import Model, Register, load_control_table
from snakewalk.drivers.protocol.packet import ALERT, ResultError
from snakewalk.drivers.protocol.registers import (
    POSITION_MODE,
    VELOCITY_MODE,
    WATCHDOG_TRIPPED,
)
from snakewalk.sim.servo.indirect import Indirect
from snakewalk.sim.servo.register_rules import (
    GOALS,
    MODE_RESETS,
    ModelRegisters,
    limit_of,
    registers_of,
)

_COMPARED_REGISTERS = (
    "Torque Enable",
    "Goal Position",
    "Present Position",
    "Present Input Voltage",
    "Status Return Level",
    "Bus Watchdog",
)
"""Registers that show whether two models have the same layout."""


@dataclass(frozen=True, slots=True)
class ServoScales:
    """Units of S servos, (S,) each."""

    positions_per_rad: Floats
    positions_per_turn: Floats
    zero_position: Floats
    rad_s_per_velocity: Floats
    rad_s2_per_acceleration: Floats
    full_pwm: Floats
    lowest_position: Floats
    """Limit within one turn."""
    homing_limit: Floats
    """Largest homing offset in raw positions; infinite without a limit."""

    @staticmethod
    def of(models: Sequence[ServoModel]) -> "ServoScales":
        """Scales of servos of these models."""
        rows = [
            (
                m.positions_per_rad,
                m.units.positions_per_turn,
                m.units.zero_position,
                m.rad_s_per_velocity,
                m.rad_s2_per_acceleration,
                m.units.full_pwm,
                m.units.zero_position - m.units.positions_per_turn / 2.0,
                math.inf if m.units.homing_limit is None else m.units.homing_limit,
            )
            for m in models
        ]
        return ServoScales(*np.array(rows, np.float64).reshape(-1, 8).T.copy())


class ServoBank:
    """S servos with factory settings except ID and baud rate, of one or several models.

    The registers of a run have the same address in all models, so a register is one column. Other
    registers and the rules are looked up by row.

    Args:
        ids: in the order of the chain.
        model: name, file or record; of all servos, or (S,) of each.
        baud: of all servos.

    Raises:
        ControlTableError: a model cannot be simulated, two models have registers at different
            addresses, an ID is out of range or used twice, or a model lacks the baud rate.

    """

    def __init__(
        self,
        ids: Sequence[int],
        model: Model | Sequence[Model] = "XM430-W350",
        baud: int = 1_000_000,
    ) -> None:
        self.ids = tuple(ids)
        self.baud = baud
        """Baud rate of the bus with factory-new servos."""
        models: Sequence[Model] = (
            [model] * len(self.ids) if isinstance(model, str | ServoModel) else model
        )
        by_name = {
            registers.layout.model: registers for registers in map(registers_of, _different(models))
        }
        self._of_row = [by_name[load_control_table(model_name).model] for model_name in models]
        kinds = list(by_name.values())
        faults = [
            f"ID {servo_id}: a servo has 0 to 252"
            for servo_id in self.ids
            if not 0 <= servo_id <= 252
        ]
        if len(set(self.ids)) != len(self.ids):
            faults.append(f"two servos share an ID: {', '.join(map(str, sorted(self.ids)))}")
        faults += [
            f"{baud} baud: {kind.layout.model} has {', '.join(map(str, kind.facts.bauds))}"
            for kind in kinds
            if baud not in kind.facts.bauds
        ]
        faults += [
            f"{kind.layout.model} and {kinds[0].layout.model} have {name} at different addresses: "
            "they cannot be on one simulated line"
            for kind in kinds[1:]
            for name in _COMPARED_REGISTERS
            if kind.layout[name] != kinds[0].layout[name]
        ][:1]
        if faults:
            raise ControlTableError(faults)
        self.models = tuple(registers.layout.model for registers in self._of_row)
        """(S,) names as printed on the servos."""
        self.measures_current = np.array(
            [registers.measures_current for registers in self._of_row], bool
        )
        """(S,) whether a servo measures its current."""
        self.false_alert = np.zeros(len(self.ids), bool)
        """(S,) servos that set the alert bit of their replies without an error."""
        self.table: Bytes = np.zeros((len(self.ids), TABLE_BYTES), np.uint8)
        rows = [np.flatnonzero([registers is kind for registers in self._of_row]) for kind in kinds]
        self._kinds = tuple(zip(kinds, rows, strict=True))
        self.scales = ServoScales.of([registers.facts for registers in self._of_row])
        self._registers = _in_one_place(kinds)
        self._columns = {name: self._column(layout) for name, layout in self._registers.items()}
        self._defined = np.zeros((len(self.ids), TABLE_BYTES), bool)
        for kind, rows_of_kind in self._kinds:
            for layout in kind.registers.values():
                self._defined[rows_of_kind, layout.address : layout.address + layout.size] = True
        self._starts = {
            kind.layout.model: {layout.address: layout for layout in kind.registers.values()}
            for kind in kinds
        }
        self.indirect = Indirect(
            self.table,
            [
                (slice(None) if len(kinds) == 1 else rows_of_kind, kind.indirect)
                for kind, rows_of_kind in self._kinds
            ],
        )
        self._registered: dict[int, tuple[int, bytes]] = {}
        self._backup: dict[int, bytes] = {}
        self.reset(np.arange(len(self.ids)), kept_names=())
        self["ID"][:] = self.ids
        self._codes = [
            {rate: code for code, rate in enumerate(registers.facts.bauds)}
            for registers in self._of_row
        ]
        self["Baud Rate"][:] = [codes[baud] for codes in self._codes]

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, name: str) -> SignedInts:
        """(S,) live view of a register; 0 for servos without it."""
        return self._columns[name]

    def __contains__(self, name: object) -> bool:
        """Whether servos have the register, all at the same address."""
        return name in self._columns

    @property
    def names(self) -> Iterable[str]:
        """Registers with the same address in all models that have them."""
        return self._registers

    def register(self, name: str) -> Register:
        """Address, size and sign of a register."""
        return self._registers[name]

    def has(self, row: int, name: str) -> bool:
        """Whether a servo has a register."""
        return name in self._of_row[row].registers

    @property
    def facts(self) -> tuple[ServoModel, ...]:
        """(S,) records of the models."""
        return tuple(registers.facts for registers in self._of_row)

    def range_of(self, row: int, name: str) -> tuple[int, int]:
        """Lowest and highest accepted value; 0 and 0 if read-only."""
        rule = self._of_row[row].rules[name]
        return (rule.low or 0, rule.high or 0)

    def tuned_to(self, baud: int) -> Indices:
        """Rows of the servos at ``baud``."""
        codes = np.array([codes.get(baud, -1) for codes in self._codes])
        return np.flatnonzero(self["Baud Rate"] == codes)

    def alert(self, rows: Indices | slice | int) -> Bytes:
        """Bit 7 of the error field: Hardware Error Status(70) is not 0."""
        wrong = (self["Hardware Error Status"][rows] != 0) | self.false_alert[rows]
        alert: Bytes = np.multiply(wrong, ALERT, dtype=np.uint8)
        return alert

    def shut_down(self, row: int) -> bool:
        """Whether a hardware error in Shutdown(63) keeps the torque off until a reboot."""
        return bool(self["Hardware Error Status"][row] & self["Shutdown"][row])

    def readable(self, rows: Indices | int, address: int, length: int) -> bool:
        """Whether a block is in the tables of some servos and begins at a register of each.

        Gaps between registers read as 0.
        """
        inside = length > 0 and address >= 0 and address + length <= TABLE_BYTES
        return inside and bool(self._defined[rows, address].all())

    def check(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """Error of the reply to a write of ``data``; writes nothing.

        ``ram_only`` rejects the EEPROM, as for a servo addressed by its secondary ID.
        """
        if not data:
            return ResultError.DATA_LENGTH
        registers = self._of_row[row]
        starts = self._starts[registers.layout.model]
        for start, run in self.indirect.resolve(row, address, data, registers.indirect):
            position = start
            while position < start + len(run):
                register = starts.get(position)
                if register is None:
                    return ResultError.ACCESS
                rule = registers.rules[register.name]
                end = position + register.size
                if end > start + len(run):
                    return ResultError.DATA_LENGTH
                locked = position < registers.facts.ram_from and (
                    ram_only or self["Torque Enable"][row]
                )
                if not rule.writable or locked:
                    return ResultError.ACCESS
                error = self._check_value(
                    row, register.name, register.decode(run[position - start : end - start])
                )
                if error:
                    return error
                position = end
        return ResultError.NONE

    def write(self, row: int, address: int, data: bytes, *, ram_only: bool = False) -> ResultError:
        """Write a block to one servo completely or, with an error, not at all."""
        error = self.check(row, address, data, ram_only=ram_only)
        if not error:
            for start, run in self.indirect.resolve(row, address, data, self._of_row[row].indirect):
                self.table[row, start : start + len(run)] = np.frombuffer(run, np.uint8)
            self.indirect.on_write(address, len(data))
        return error

    def register_write(
        self, row: int, address: int, data: bytes, *, ram_only: bool = False
    ) -> ResultError:
        """Reg Write: check as ``write``, and store for Action."""
        error = self.check(row, address, data, ram_only=ram_only)
        if not error:
            self._registered[row] = (address, data)
            self["Registered Instruction"][row] = 1
        return error

    def take_registered(self, row: int) -> tuple[int, bytes] | None:
        """Remove and return the registered write (address, data), or None."""
        self["Registered Instruction"][row] = 0
        return self._registered.pop(row, None)

    def reset(self, rows: Indices, kept_names: Sequence[str], ram_only: bool = False) -> None:
        """Set initial values, in the RAM only (reboot) or in both areas (factory reset)."""
        for kind, rows_of_kind in self._kinds:
            some = np.intersect1d(rows, rows_of_kind)
            for name, rule in kind.rules.items():
                register = kind.registers[name]
                if name not in kept_names and not (
                    ram_only and register.address < kind.facts.ram_from
                ):
                    self._column(register)[some] = rule.initial
            for goal in GOALS[:3]:
                if goal in kind.registers:
                    self[goal][some] = self[limit_of(goal)][some]
        self._zero_goal_velocity(rows)
        for row in rows:
            self._registered.pop(int(row), None)
            if "Backup Ready" in self:
                self["Backup Ready"][row] = int(row) in self._backup
        self.indirect.refresh()

    def back_up(self, row: int) -> ResultError:
        """Store the EEPROM and the backed-up part of the RAM; only with torque off (e-manual)."""
        if self["Torque Enable"][row]:
            return ResultError.RESULT_FAIL
        if not self.has(row, "Backup Ready"):
            return ResultError.INSTRUCTION
        self._backup[row] = self.table[row].tobytes()
        self["Backup Ready"][row] = 1
        return ResultError.NONE

    def restore(self, row: int) -> ResultError:
        """Restore the stored EEPROM; the servo then reboots."""
        if self["Torque Enable"][row] or row not in self._backup:
            return ResultError.RESULT_FAIL
        end = self._of_row[row].facts.ram_from
        self.table[row, :end] = np.frombuffer(self._backup[row], np.uint8)[:end]
        return ResultError.NONE

    def restore_ram(self, row: int) -> None:
        """Restore the stored gains, profile and indirect addresses (RAM Restore, at start)."""
        kept = self._backup.get(row)
        if kept is None:
            return
        stored = np.frombuffer(kept, np.uint8)
        registers = self._of_row[row].registers
        for name, register in registers.items():
            if name in MODE_RESETS or name.startswith("Indirect Address"):
                block = slice(register.address, register.address + register.size)
                self.table[row, block] = stored[block]
        self.indirect.refresh()

    def switch_mode(self, rows: Indices) -> None:
        """Reset gains, profile and output limits after a change of Operating Mode(11)."""
        for kind, rows_of_kind in self._kinds:
            some = np.intersect1d(rows, rows_of_kind)
            for name in MODE_RESETS:
                self[name][some] = kind.rules[name].initial
            for goal in ("Goal PWM", "Goal Current"):
                if goal in kind.registers:
                    self[goal][some] = self[limit_of(goal)][some]
        self._zero_goal_velocity(rows)

    def _zero_goal_velocity(self, rows: Indices) -> None:
        """Stop servos in velocity mode: enabling torque alone causes no motion.

        (E-manual, Bus Watchdog(98), example, steps 1 and 2.)
        """
        turning = rows[self["Operating Mode"][rows] == VELOCITY_MODE]
        self["Goal Velocity"][turning] = 0

    def _check_value(self, row: int, name: str, value: int) -> ResultError:
        rule = self._of_row[row].rules[name]
        if rule.low is not None and rule.high is not None and not rule.low <= value <= rule.high:
            return ResultError.DATA_RANGE
        if name == "Operating Mode" and value not in self._of_row[row].facts.modes:
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
        """Least and greatest value that a goal register accepts now."""
        if name == "Goal Position":
            if self["Operating Mode"][row] == POSITION_MODE:
                return int(self["Min Position Limit"][row]), int(self["Max Position Limit"][row])
            return self.range_of(row, name)
        limit = int(self[limit_of(name)][row])
        return -limit, limit

    def _column(self, register: Register) -> SignedInts:
        number = f"<{'i' if register.signed else 'u'}{register.size}"
        block = self.table[:, register.address : register.address + register.size]
        return block.view(number)[:, 0]


def _in_one_place(kinds: Sequence[ModelRegisters]) -> dict[str, Register]:
    """Registers with the same address in all models that have them."""
    registers: dict[str, Register] = {}
    moved_names: set[str] = set()
    for kind in kinds:
        for name, register in kind.registers.items():
            if registers.setdefault(name, register) != register:
                moved_names.add(name)
    return {name: register for name, register in registers.items() if name not in moved_names}


def _different(models: Sequence[Model]) -> list[Model]:
    return [model for k, model in enumerate(models) if model not in models[:k]]
