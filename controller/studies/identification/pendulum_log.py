"""Recordings of a servo that swings a weight, as BAM's raw logs hold them."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_json_object
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError

_COLUMNS = ("timestamp", "goal_position", "position", "input_volts", "torque_enable")
_LOG_KEYS = ("mass", "length", "kp")
_LIMIT = "goal_current_a"
"""Our addition to BAM's logs: Goal Current of a servo in current-based position mode."""
_LEAST_ROWS = 20


@dataclass(frozen=True, slots=True)
class PendulumLog:
    """One recording of N samples; the weight hangs down at 0."""

    path: Path
    actuator: str
    mass_kg: float
    arm_m: float
    p_gain: float
    """Position P Gain(84)."""
    time_s: Floats
    """(N,) rising."""
    goal_rad: Floats
    """(N,) goal angles, rad."""
    position_rad: Floats
    """(N,) measured angles, rad."""
    supply_v: Floats
    """(N,) supply voltages, V."""
    torque_on: Floats
    """(N,) 1 while torque was on, else 0."""
    current_limit_a: float = math.inf
    """Goal Current of current-based position mode; infinite in other modes."""


def read_pendulum_log(path: Path) -> PendulumLog:
    """Read a raw log of BAM: mass, length, kp, and entries of position, goal, volts and torque.

    Raises:
        InputError: it is not such a file, with its missing parts.

    """
    data = read_json_object(path)
    entries = data.get("entries")
    faults = [f"{path}: {key}: is missing" for key in (*_LOG_KEYS, "entries") if key not in data]
    if faults:
        raise InputError(faults)
    try:
        mass_kg, arm_m, p_gain = (_number(data[key]) for key in _LOG_KEYS)
        limit_a = math.inf if _LIMIT not in data else _number(data[_LIMIT])
        rows: Any = entries
        time_s, goal, position, volts, torque = (
            np.array([_number(row[key]) for row in rows]) for key in _COLUMNS
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: is not a log of a pendulum: {error}; choose another file"
        ) from None
    if len(time_s) < _LEAST_ROWS or not (np.diff(time_s) >= 0.0).all():
        raise InputError(f"{path}: expected at least {_LEAST_ROWS} entries in the order of time")
    if not (mass_kg > 0.0 and arm_m > 0.0 and p_gain >= 0.0):
        raise InputError(f"{path}: mass and length are positive, kp is not negative")
    if not limit_a > 0.0:
        raise InputError(
            f"{path}: {_LIMIT} is {limit_a:g}; give the Goal Current of mode 5 in A, or omit it"
        )
    actuator = str(data.get("motor", ""))
    return PendulumLog(
        path,
        actuator,
        mass_kg,
        arm_m,
        p_gain,
        time_s - time_s[0],
        goal,
        position,
        volts,
        (torque > 0.0).astype(float),
        limit_a,
    )


def _number(value: object) -> float:
    if not isinstance(value, int | float):  # true and false count as 1 and 0
        raise ValueError(f"{value!r} is no number")
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"{value} is not finite")
    return number
