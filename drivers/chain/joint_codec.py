"""Joint goals to raw goal positions inside the joint limits."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numba import boolean, float64, int32, int64, types, uint8, void
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats
from snakewalk.drivers.bus.group_read import GroupAnswer
from snakewalk.drivers.compiling import COMPILES, compiled
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import ControlTable
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V, ServoUnits
from snakewalk.drivers.types import JointState

Ticks = NDArray[np.int32]


class GoalTicks:
    """Nearest ticks of J goals, kept within the limits; in numpy, or compiled with numba."""

    def __init__(self, units: ServoUnits, limits: Ticks, *, compiled: bool | None = None) -> None:
        """Take the limits (J, 2), raw; ``compiled`` None takes numba where it is installed."""
        self._units = units
        self._low, self._high = np.ascontiguousarray(limits.T, np.int32)
        self._scale = np.array([units.rad_per_position, float(units.zero_position)])
        self._loop: Callable[[Floats, Floats, Ticks, Ticks, Ticks], bool] | None = None
        if COMPILES if compiled is None else compiled:
            self._loop = ticks

    def of(self, goal_rad: Floats) -> Ticks:
        """(J,) raw goals, a new array.

        Raises:
            ValueError: a goal is not finite, or there are not J of them.

        """
        if goal_rad.shape != self._low.shape:
            raise ValueError(f"goals of shape {goal_rad.shape} for {len(self._low)} joints")
        if self._loop is None:
            raw = self._units.position_raw(goal_rad)
            return np.asarray(np.minimum(np.maximum(raw, self._low), self._high))
        raw = np.empty_like(self._low)
        if not self._loop(goal_rad, self._scale, self._low, self._high, raw):
            raise ValueError("an angle is not finite")
        return raw


class StateBlock:
    """Registers from Present Current to Present Position, all servos at once.

    In numpy, moved by two bytes, the block is three words of four bytes: the current (two bytes)
    stands in the upper half of the first, which makes it 65,536 times as large, sign and all.
    """

    def __init__(
        self, joints: int, table: ControlTable, units: ServoUnits, *, compiled: bool | None = None
    ) -> None:
        """Check the layout; ``compiled`` None takes numba where it is installed.

        Raises:
            ControlTableError: the registers do not lie as in every model of Protocol 2.0.

        """
        registers = [table[f"Present {name}"] for name in ("Current", "Velocity", "Position")]
        start = registers[0].address
        if [(r.address - start, r.size) for r in registers] != [(0, 2), (2, 4), (6, 4)]:
            raise ControlTableError(
                [f"{table.model}: Present Current, Velocity and Position do not lie in a row"]
            )
        self._zero = np.array([0.0, 0.0, float(units.zero_position)])
        self._scale = np.array(
            [units.a_per_current, units.rad_s_per_velocity, units.rad_per_position]
        )
        self._bytes = np.zeros((joints, 12), np.uint8)
        self._block = self._bytes[:, 2:]
        self._words = self._bytes.view("<i4").T
        self._word_scale = self._scale / [65_536.0, 1.0, 1.0]
        self._loop: Callable[[Bytes, Floats, Floats, Floats], None] | None = None
        if COMPILES if compiled is None else compiled:
            self._loop = motion

    def motion(self, data: Bytes, out: Floats) -> None:
        """Current, A, velocity, rad/s, and position, rad, of blocks (J, 10) into ``out`` (3, J)."""
        if self._loop is not None:
            self._loop(data, self._zero, self._scale, out)
            return
        self._block[:] = data
        np.subtract(self._words, self._zero[:, None], out=out)
        out *= self._word_scale[:, None]


_BLOCKS = types.Array(uint8, 2, "A", readonly=True)
_GOALS = types.Array(float64, 1, "A", readonly=True)


@compiled(int64(_BLOCKS, int64, int64, int64))
def _signed(data: NDArray[np.uint8], row: int, at: int, size: int) -> int:
    value = 0
    for k in range(size):
        value |= int(data[row, at + k]) << (8 * k)
    half = 1 << (8 * size - 1)
    return value - 2 * half if value >= half else value


@compiled(void(_BLOCKS, float64[::1], float64[::1], float64[:, ::1]))
def motion(data: NDArray[np.uint8], zero: Floats, scale: Floats, out: Floats) -> None:
    """Current, velocity and position of blocks (J, 10) into ``out`` (3, J)."""
    for row in range(len(data)):
        out[0, row] = (_signed(data, row, 0, 2) - zero[0]) * scale[0]
        out[1, row] = (_signed(data, row, 2, 4) - zero[1]) * scale[1]
        out[2, row] = (_signed(data, row, 6, 4) - zero[2]) * scale[2]


@compiled(boolean(_GOALS, float64[::1], int32[::1], int32[::1], int32[::1]))
def ticks(
    goal_rad: Floats,
    scale: Floats,
    low: NDArray[np.int32],
    high: NDArray[np.int32],
    out: NDArray[np.int32],
) -> bool:
    """Nearest ticks of goals (J,) within ``low`` to ``high``; false if a goal is no number."""
    for joint in range(len(goal_rad)):
        if not np.isfinite(goal_rad[joint]):
            return False
        tick = np.rint(goal_rad[joint] / scale[0] + scale[1])
        out[joint] = int(min(max(tick, float(low[joint])), float(high[joint])))
    return True


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
