"""Joint goals (rad) to raw goal positions, and raw state blocks to a ``JointState`` (SI units)."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numba import boolean, float64, int32, int64, types, uint8, void
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats, Int32s
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.compiling import compiled
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import ControlTable
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V, ServoUnits
from snakewalk.drivers.types import JointState

S = TypeVar("S", bound=np.generic)
_BLOCKS = types.Array(uint8, 2, "A", readonly=True)
_GOALS = types.Array(float64, 1, "A", readonly=True)


class GoalEncoder:
    """Nearest raw goal positions of J goals, clamped to the joint limits."""

    def __init__(self, units: ServoUnits, limits: Int32s) -> None:
        """Take the raw limits (J, 2)."""
        self._low, self._high = np.ascontiguousarray(limits.T, np.int32)
        self._scale = np.array([units.rad_per_position, float(units.zero_position)])

    def encode(self, goal_rad: Floats) -> Int32s:
        """(J,) raw goals, a new array.

        Raises:
            ValueError: a goal is not finite, or there are not J of them.

        """
        if goal_rad.shape != self._low.shape:
            raise ValueError(f"goals of shape {goal_rad.shape} for {len(self._low)} joints")
        raw: Int32s = np.empty_like(self._low)
        if not encode_goals(goal_rad, self._scale, self._low, self._high, raw):
            raise ValueError("an angle is not finite")
        return raw


@compiled(boolean(_GOALS, float64[::1], int32[::1], int32[::1], int32[::1]))
def encode_goals(goal_rad: Floats, scale: Floats, low: Int32s, high: Int32s, raw: Int32s) -> bool:
    """Nearest positions of goals (J,) within ``low`` to ``high``; False if a goal is not finite.

    ``scale`` is rad per position and the position of 0 rad.
    """
    for joint in range(len(goal_rad)):
        if not np.isfinite(goal_rad[joint]):
            return False
        nearest = np.rint(goal_rad[joint] / scale[0] + scale[1])
        raw[joint] = int(min(max(nearest, float(low[joint])), float(high[joint])))
    return True


class StateDecoder:
    """Present Current, Velocity and Position of all servos at once, from their state blocks."""

    def __init__(self, table: ControlTable, units: ServoUnits) -> None:
        """Check the layout of the registers.

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

    def decode(self, data: Bytes, out: Floats) -> None:
        """Current, A, velocity, rad/s, and position, rad, of blocks (J, 10) into ``out`` (3, J)."""
        decode_state(data, self._zero, self._scale, out)


@compiled(int64(_BLOCKS, int64, int64, int64))
def _signed(data: Bytes, row: int, at: int, size: int) -> int:
    value = 0
    for k in range(size):
        value |= int(data[row, at + k]) << (8 * k)
    half = 1 << (8 * size - 1)
    return value - 2 * half if value >= half else value


@compiled(void(_BLOCKS, float64[::1], float64[::1], float64[:, ::1]))
def decode_state(data: Bytes, zero: Floats, scale: Floats, out: Floats) -> None:
    """Current, velocity and position of blocks (J, 10) into ``out`` (3, J)."""
    for row in range(len(data)):
        out[0, row] = (_signed(data, row, 0, 2) - zero[0]) * scale[0]
        out[1, row] = (_signed(data, row, 2, 4) - zero[1]) * scale[1]
        out[2, row] = (_signed(data, row, 6, 4) - zero[2]) * scale[2]


class Readings:
    """Newest value of every quantity of J joints; NaN before the first."""

    def __init__(self, joints: int, table: ControlTable, units: ServoUnits) -> None:
        self._decoder = StateDecoder(table, units)
        self._numbers = np.full((7, joints), np.nan)
        self._motion = self._numbers[:3]
        self._temperature, self._voltage = self._numbers[3:5]
        self._measured_at_s, self._slow_at_s = self._numbers[5:]
        self._numbers[5:] = -np.inf
        self._hardware_error = np.zeros(joints, np.uint8)
        self._error = np.zeros(joints, np.uint8)
        self._valid = np.zeros(joints, np.bool_)
        self._alarmed = False
        self._flags = self._frozen_flags()

    def update(self, reply: GroupReadReply, measured_at_s: float) -> Sequence[int]:
        """Take new state blocks; returns the joints whose alarm (register 70) must be read."""
        ok = reply.valid
        trouble = np.count_nonzero(reply.error) or self._alarmed
        if not trouble and np.count_nonzero(ok) == len(ok):  # the regular case
            self._decoder.decode(reply.data, self._motion)
            self._measured_at_s.fill(measured_at_s)
            if ok is not self._valid:
                self._valid = ok
                self._flags = self._frozen_flags()
            return ()
        self._valid = ok
        motion = np.empty_like(self._motion)
        self._decoder.decode(reply.data, motion)
        self._motion[:, ok] = motion[:, ok]
        self._measured_at_s[ok] = measured_at_s
        self._error[reply.answered] = reply.error[reply.answered]
        alert = (reply.error & ALERT) != 0
        self._hardware_error[reply.answered & ~alert] = 0  # without the alert bit register 70 is 0
        self._alarmed = bool(self._error.any() or self._hardware_error.any())
        self._flags = self._frozen_flags()
        return np.flatnonzero(alert & (self._hardware_error == 0)).tolist()

    def update_alarm(self, joint: int, hardware_error: int) -> None:
        """Take one joint's register 70."""
        self._hardware_error[joint] = hardware_error
        self._alarmed = True
        self._flags = self._frozen_flags()

    def update_slow(self, reply: GroupReadReply, measured_at_s: float) -> None:
        """Take the slow blocks: Present Input Voltage (2 bytes), Present Temperature (1)."""
        ok = reply.valid
        low, high = reply.data[ok, 0], reply.data[ok, 1].astype(np.uint16)
        self._voltage[ok] = (high << 8 | low) * VOLTAGE_UNIT_V
        self._temperature[ok] = reply.data[ok, 2]
        self._slow_at_s[ok] = measured_at_s

    def slow_at_s(self) -> float:
        """When the oldest temperature and voltage were measured; before the first, -inf."""
        return float(self._slow_at_s.min())

    def state(self, now_s: float) -> JointState:
        """Read-only copies of everything."""
        numbers = np.empty_like(self._numbers)
        _copy(self._numbers, now_s, numbers)
        numbers.setflags(write=False)
        current, velocity, position, temperature, voltage, age_s, slow_age_s = numbers
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
            slow_age_s=slow_age_s,
        )

    def _frozen_flags(self) -> tuple[Bytes, Bytes, Bools]:
        """Read-only copies of what rarely changes; the same objects until it does."""
        return _frozen(self._hardware_error), _frozen(self._error), _frozen(self._valid)


@compiled("void(float64[:, ::1], float64, float64[:, ::1])")
def _copy(numbers: Floats, now_s: float, copy: Floats) -> None:
    """Copy (7, J), with ages in place of the measuring times in the last two rows."""
    for joint in range(numbers.shape[1]):
        for row in range(5):
            copy[row, joint] = numbers[row, joint]
        copy[5, joint] = now_s - numbers[5, joint]
        copy[6, joint] = now_s - numbers[6, joint]


def _frozen(array: NDArray[S]) -> NDArray[S]:
    copy = array.copy()
    copy.setflags(write=False)
    return copy
