"""Registers and loads of simulated servos, set by a console or a test."""

import math
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Final

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bench import BenchPlant

BenchLine = SimLine | Ax12Line
_MEASURED: Final = ("Present ", "Realtime Tick", "Moving", "Model Number", "Firmware Version")


def rows_of(line: BenchLine, servo_ids: Sequence[int] | None) -> list[int]:
    """Rows of servos by their IDs; None: all.

    Raises:
        InputError: an ID is unknown.

    """
    there = {servo_id: row for row, servo_id in enumerate(line.ids())}
    if servo_ids is None:
        return list(there.values())
    missing = [str(each) for each in servo_ids if each not in there]
    if missing:
        known = ", ".join(map(str, there))
        raise InputError(f"no servo has ID {', '.join(missing)}; the bus has {known}")
    return [there[each] for each in servo_ids]


def register_name(line: BenchLine, name: str, rows: Sequence[int]) -> str:
    """Name of a register as in the tables.

    Raises:
        InputError: not all servos have it; lists the closest names.

    """
    known = {each.lower(): each for each in _names(line)}
    found = known.get(name.lower())
    if found is not None and all(line.register_type(row, found) is not None for row in rows):
        return found
    close = [known[each] for each in get_close_matches(name.lower(), known, 3, 0.5)]
    hint = f"; did you mean {', '.join(close)}?" if close and found is None else ""
    raise InputError(f"{name or 'REGISTER'}: no register of all these servos{hint}")


def _names(line: BenchLine) -> Iterable[str]:
    return line.bank.names if isinstance(line, SimLine) else line.servos.facts.registers


def set_register(line: BenchLine, rows: Sequence[int], name: str, value: int) -> str:
    """Set a register of servos, like their firmware; return its name in the tables.

    Raises:
        InputError: the register is unknown or measured by the servo, or the value is not whole.
        ControlTableError: the value does not fit.

    """
    if not isinstance(value, int | np.integer):
        raise InputError(f"{name} {value}: must be a whole number")
    value = int(value)
    found = register_name(line, name, rows)
    if found.startswith(_MEASURED):
        raise InputError(f"{found}: is measured, not set; see load and fault")
    if isinstance(line, Ax12Line):
        line.write_register(np.array(rows, np.intp), found, value)
        line.refresh_ids()
        return found
    bank = line.bank
    register = bank.register(found)
    data = register.encode(value)
    for row in rows:
        bank.table[row, register.address : register.address + register.size] = list(data)
    bank.indirect.refresh()
    line.firmware.apply_registers()
    line.refresh_ids()
    return found


def set_load(line: BenchLine, rows: Sequence[int], load_n_m: float) -> None:
    """Put a constant torque on shafts.

    Raises:
        InputError: the servos turn a robot's body, which has the ground as its load, or the torque
            is not finite.

    """
    if not math.isfinite(load_n_m):
        raise InputError(f"load {load_n_m:g}: must be a finite number of N m")
    plant = line.firmware.plant if isinstance(line, SimLine) else line.servos.plant
    if not isinstance(plant, BenchPlant):
        raise InputError("load: only shafts of a bench (--servos) have one; a robot has ground")
    plant.set_load(rows, load_n_m)
