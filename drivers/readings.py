"""What the servos last said: blocks in, ``JointState`` out; what was not read is held and ages."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.compiling import compiled
from drivers.control_table import ControlTable
from drivers.group_answer import GroupAnswer
from drivers.protocol.packet import ALERT
from drivers.state_block import StateBlock
from drivers.types import Bools, Floats, JointState
from drivers.units import VOLTAGE_UNIT_V, ServoUnits

Bytes = NDArray[np.uint8]
S = TypeVar("S", bound=np.generic)


class Readings:
    """Newest value of every quantity of J joints; NaN before the first."""

    def __init__(self, joints: int, table: ControlTable, units: ServoUnits) -> None:
        self._block = StateBlock(joints, table, units)
        self._numbers = np.full((6, joints), np.nan)
        self._motion = self._numbers[:3]
        self._temperature, self._voltage, self._read_at_s = self._numbers[3:]
        self._read_at_s[:] = -np.inf
        self._hardware_error = np.zeros(joints, np.uint8)
        self._error = np.zeros(joints, np.uint8)
        self._valid = np.zeros(joints, np.bool_)
        self._alarmed = False
        self._flags = self._frozen_flags()

    def take(self, answer: GroupAnswer, now_s: float) -> Sequence[int]:
        """Take the state block in; returns the joints whose alarm (register 70) must be read."""
        ok = answer.valid
        trouble = np.count_nonzero(answer.error) or self._alarmed
        if not trouble and np.count_nonzero(ok) == len(ok):  # as nearly always
            self._block.motion(answer.data, self._motion)
            self._read_at_s.fill(now_s)
            if ok is not self._valid:
                self._valid = ok
                self._flags = self._frozen_flags()
            return ()
        self._valid = ok
        motion = np.empty_like(self._motion)
        self._block.motion(answer.data, motion)
        self._motion[:, ok] = motion[:, ok]
        self._read_at_s[ok] = now_s
        self._error[answer.answered] = answer.error[answer.answered]
        alert = (answer.error & ALERT) != 0
        self._hardware_error[answer.answered & ~alert] = 0  # bit 7 says: register 70 is not 0
        self._alarmed = bool(self._error.any() or self._hardware_error.any())
        self._flags = self._frozen_flags()
        return np.flatnonzero(alert & (self._hardware_error == 0)).tolist()

    def take_alarm(self, joint: int, hardware_error: int) -> None:
        """Take one joint's register 70 in."""
        self._hardware_error[joint] = hardware_error
        self._alarmed = True
        self._flags = self._frozen_flags()

    def take_slow(self, answer: GroupAnswer) -> None:
        """Take the block of Present Input Voltage (2 bytes) and Present Temperature (1) in."""
        ok = answer.valid
        low, high = answer.data[ok, 0], answer.data[ok, 1].astype(np.uint16)
        self._voltage[ok] = (high << 8 | low) * VOLTAGE_UNIT_V
        self._temperature[ok] = answer.data[ok, 2]

    def state(self, now_s: float) -> JointState:
        """Read-only copies of everything."""
        numbers = np.empty_like(self._numbers)
        _copy(self._numbers, now_s, numbers)
        numbers.setflags(write=False)
        current, velocity, position, temperature, voltage, age_s = numbers
        hardware_error, error, valid = self._flags
        return JointState(
            time_s=now_s,
            position_rad=position,
            velocity_rad_s=velocity,
            current_a=current,
            temperature_c=temperature,
            voltage_v=voltage,
            hardware_error=hardware_error,
            error=error,
            age_s=age_s,
            valid=valid,
        )

    def _frozen_flags(self) -> tuple[Bytes, Bytes, Bools]:
        """Read-only copies of what hardly ever changes; handed out again until it does."""
        return _frozen(self._hardware_error), _frozen(self._error), _frozen(self._valid)


@compiled("void(float64[:, ::1], float64, float64[:, ::1])")
def _copy(numbers: Floats, now_s: float, copy: Floats) -> None:
    """Copy (6, J), with ages instead of the times of the reading in the last row."""
    for joint in range(numbers.shape[1]):
        for row in range(5):
            copy[row, joint] = numbers[row, joint]
        copy[5, joint] = now_s - numbers[5, joint]


def _frozen(array: NDArray[S]) -> NDArray[S]:
    copy = array.copy()
    copy.setflags(write=False)
    return copy
