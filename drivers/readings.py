"""What the servos last said: blocks in, ``JointState`` out; what was not read is held and ages."""

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.control_table import ControlTable
from drivers.group_answer import GroupAnswer
from drivers.protocol.packet import ALERT
from drivers.types import JointState
from drivers.units import VOLTAGE_UNIT_V, ServoUnits

Bytes = NDArray[np.uint8]
S = TypeVar("S", bound=np.generic)


class Readings:
    """Newest value of every quantity of J joints; NaN before the first."""

    def __init__(self, joints: int, table: ControlTable, units: ServoUnits) -> None:
        self._units = units
        self._columns = [
            _column(table, name)
            for name in ("Present Current", "Present Velocity", "Present Position")
        ]
        self._numbers = np.full((6, joints), np.nan)
        (
            self._position,
            self._velocity,
            self._current,
            self._temperature,
            self._voltage,
            self._read_at_s,
        ) = self._numbers
        self._read_at_s[:] = -np.inf
        self._hardware_error = np.zeros(joints, np.uint8)
        self._error = np.zeros(joints, np.uint8)
        self._valid = np.zeros(joints, np.bool_)
        self._alarmed = False

    def take(self, answer: GroupAnswer, now_s: float) -> Sequence[int]:
        """Take the state block in; returns the joints whose alarm (register 70) must be read."""
        units = self._units
        current, velocity, position = (
            answer.data[where].view(kind)[:, 0] for where, kind in self._columns
        )
        self._valid = ok = answer.valid
        trouble = np.count_nonzero(answer.error) or self._alarmed
        if not trouble and np.count_nonzero(ok) == len(ok):  # as nearly always
            self._current[:] = units.current_a(current)
            self._velocity[:] = units.velocity_rad_s(velocity)
            self._position[:] = units.position_rad(position)
            self._read_at_s[:] = now_s
            return ()
        self._current[ok] = units.current_a(current[ok])
        self._velocity[ok] = units.velocity_rad_s(velocity[ok])
        self._position[ok] = units.position_rad(position[ok])
        self._read_at_s[ok] = now_s
        self._error[answer.answered] = answer.error[answer.answered]
        alert = (answer.error & ALERT) != 0
        self._hardware_error[answer.answered & ~alert] = 0  # bit 7 says: register 70 is not 0
        self._alarmed = bool(self._error.any() or self._hardware_error.any())
        return np.flatnonzero(alert & (self._hardware_error == 0)).tolist()

    def take_alarm(self, joint: int, hardware_error: int) -> None:
        """Take one joint's register 70 in."""
        self._hardware_error[joint] = hardware_error
        self._alarmed = True

    def take_slow(self, answer: GroupAnswer) -> None:
        """Take the block of Present Input Voltage (2 bytes) and Present Temperature (1) in."""
        ok = answer.valid
        low, high = answer.data[ok, 0], answer.data[ok, 1].astype(np.uint16)
        self._voltage[ok] = (high << 8 | low) * VOLTAGE_UNIT_V
        self._temperature[ok] = answer.data[ok, 2]

    def state(self, now_s: float) -> JointState:
        """Read-only copies of everything."""
        numbers = _frozen(self._numbers)
        position, velocity, current, temperature, voltage, read_at_s = numbers
        return JointState(
            time_s=now_s,
            position_rad=position,
            velocity_rad_s=velocity,
            current_a=current,
            temperature_c=temperature,
            voltage_v=voltage,
            hardware_error=_frozen(self._hardware_error),
            error=_frozen(self._error),
            age_s=_frozen(now_s - read_at_s),
            valid=_frozen(self._valid),
        )


def _column(table: ControlTable, name: str) -> tuple[tuple[slice, slice], np.dtype[Any]]:
    """Columns and type of a signed register in the state block."""
    register = table[name]
    at = register.address - table["Present Current"].address
    return (slice(None), slice(at, at + register.size)), np.dtype(f"<i{register.size}")


def _frozen(array: NDArray[S]) -> NDArray[S]:
    copy = array.copy()
    copy.setflags(write=False)
    return copy
