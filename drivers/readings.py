"""What the servos last said: blocks in, ``JointState`` out; what was not read is held and ages."""

from typing import TypeVar

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
        self._current = np.full(joints, np.nan)
        self._velocity = np.full(joints, np.nan)
        self._position = np.full(joints, np.nan)
        self._temperature = np.full(joints, np.nan)
        self._voltage = np.full(joints, np.nan)
        self._hardware_error = np.zeros(joints, np.uint8)
        self._error = np.zeros(joints, np.uint8)
        self._valid = np.zeros(joints, np.bool_)
        self._read_at_s = np.full(joints, -np.inf)

    def take(self, answer: GroupAnswer, now_s: float) -> NDArray[np.intp]:
        """Take the state block in; returns the joints whose alarm (register 70) must be read."""
        ok = answer.valid
        current, velocity, position = (_signed(answer.data, at, size) for at, size in self._columns)
        self._current[ok] = self._units.current_a(current[ok])
        self._velocity[ok] = self._units.velocity_rad_s(velocity[ok])
        self._position[ok] = self._units.position_rad(position[ok])
        self._read_at_s[ok] = now_s
        self._valid = ok
        self._error[answer.answered] = answer.error[answer.answered]
        alert = (answer.error & ALERT) != 0
        self._hardware_error[answer.answered & ~alert] = 0  # bit 7 says: register 70 is not 0
        return np.flatnonzero(alert & (self._hardware_error == 0))

    def take_alarm(self, joint: int, hardware_error: int) -> None:
        """Take one joint's register 70 in."""
        self._hardware_error[joint] = hardware_error

    def take_slow(self, answer: GroupAnswer) -> None:
        """Take the block of Present Input Voltage (2 bytes) and Present Temperature (1) in."""
        ok = answer.valid
        low, high = answer.data[ok, 0], answer.data[ok, 1].astype(np.uint16)
        self._voltage[ok] = (high << 8 | low) * VOLTAGE_UNIT_V
        self._temperature[ok] = answer.data[ok, 2]

    def state(self, now_s: float) -> JointState:
        """Read-only copies of everything."""
        return JointState(
            time_s=now_s,
            position_rad=_frozen(self._position),
            velocity_rad_s=_frozen(self._velocity),
            current_a=_frozen(self._current),
            temperature_c=_frozen(self._temperature),
            voltage_v=_frozen(self._voltage),
            hardware_error=_frozen(self._hardware_error),
            error=_frozen(self._error),
            age_s=_frozen(now_s - self._read_at_s),
            valid=_frozen(self._valid),
        )


def _column(table: ControlTable, name: str) -> tuple[int, int]:
    """Place and size of a signed register in the state block."""
    register = table[name]
    return register.address - table["Present Current"].address, register.size


def _signed(data: Bytes, at: int, size: int) -> NDArray[np.signedinteger]:
    values: NDArray[np.signedinteger] = np.ascontiguousarray(data[:, at : at + size]).view(
        f"<i{size}"
    )
    return values[:, 0]


def _frozen(array: NDArray[S]) -> NDArray[S]:
    copy = array.copy()
    copy.setflags(write=False)
    return copy
