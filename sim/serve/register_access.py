"""Registers and loads of simulated servos, set by a console or a test."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.near_names import name_hint
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bench import BenchPlant

BenchLine = SimLine | Ax12Line
_MEASURED_NAMES = ("Present ", "Realtime Tick", "Moving", "Model Number", "Firmware Version")


def rows_of(line: BenchLine, servo_ids: Sequence[int] | None) -> list[int]:
    """Rows of servos by their IDs; None: all.

    Raises:
        InputError: an ID is unknown.

    """
    there = {servo_id: row for row, servo_id in enumerate(line.ids())}
    if servo_ids is None:
        return list(there.values())
    missing = [str(servo_id) for servo_id in servo_ids if servo_id not in there]
    if missing:
        ids_text = ", ".join(map(str, there))
        raise InputError(f"no servo has ID {', '.join(missing)}; the bus has {ids_text}")
    return [there[servo_id] for servo_id in servo_ids]


def register_name(line: BenchLine, name: str, rows: Sequence[int]) -> str:
    """Name of a register as in the tables.

    Raises:
        InputError: not all servos have it; lists the closest names.

    """
    names_by_lower = {plain_name.lower(): plain_name for plain_name in _names(line)}
    full_name = names_by_lower.get(name.lower())
    if full_name is not None and all(
        line.register_type(row, full_name) is not None for row in rows
    ):
        return full_name
    hint = name_hint(name, _names(line)) if full_name is None else ""
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
    full_name = register_name(line, name, rows)
    if full_name.startswith(_MEASURED_NAMES):
        raise InputError(f"{full_name}: is measured, not set; see load and fault")
    if isinstance(line, Ax12Line):
        line.write_register(np.array(rows, np.intp), full_name, value)
        line.refresh_ids()
        return full_name
    bank = line.bank
    register = bank.register(full_name)
    data = register.encode(value)
    for row in rows:
        bank.table[row, register.address : register.address + register.size] = list(data)
    bank.indirect.refresh()
    line.firmware.apply_registers()
    line.refresh_ids()
    return full_name


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
