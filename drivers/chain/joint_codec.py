"""Joint goals (rad) to raw goal positions, and raw state blocks to a ``JointState`` (SI units).

Only this file maps joints to servos: ``JointUnits`` has each servo's scales, the sign of its
mounting and its zero.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats, Int32s
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import ControlTable
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import LOAD_UNIT, VOLTAGE_UNIT_V, ServoUnits
from snakewalk.drivers.types import JointState

S = TypeVar("S", bound=np.generic)
_BLOCKS = readonly_array("uint8", 2)
_GOALS = readonly_array()


@dataclass(frozen=True, slots=True)
class JointUnits:
    """Conversions between J joints and their servos; a negative scale reverses the direction."""

    zero_position: Int32s
    """(J,) raw position of a straight joint."""
    rad_per_position: Floats
    """(J,) radians per unit of a raw position."""
    rad_s_per_velocity: Floats
    """(J,) radians a second per unit of a raw velocity."""
    a_per_current: Floats
    """(J,) amperes per unit of a raw current."""
    limits_raw: Int32s
    """(J, 2) least and greatest raw goal; in position mode the servo checks them."""
    measures_current: Bools
    """(J,) whether a servo measures its current; otherwise it is the share of full output times the
    stall current."""
    limits_current: Bools
    """(J,) whether a servo has current-based position control."""
    stall_current_a: Floats
    """(J,) stall currents of the servos, A."""
    full_pwm: Int32s
    """(J,) Goal PWM of full output."""
    current_mode: Bools
    """(J,) whether the joint runs in current-based position mode."""

    @staticmethod
    def of(
        robot: RobotConfig, servos: Sequence[ServoUnits], *, can_hold: bool = False
    ) -> "JointUnits":
        """Units of a robot's joints, with the scales of their servos (J).

        ``can_hold``: a soft hold may follow, so every joint has a current limit; otherwise only
        pitch joints do.

        Raises:
            ControlTableError: the output of a pitch joint cannot be limited.

        """
        sign = np.array(robot.signs, np.float64)
        step_rad = np.array([servo.rad_per_position for servo in servos])
        places = zip(robot.zeros_rad, servos, strict=True)
        zero = [s.zero_position + round(z / s.rad_per_position) for z, s in places]
        half = [
            math.floor(limit / step) for limit, step in zip(robot.limit_rad, step_rad, strict=True)
        ]
        for joint, (axis, servo) in enumerate(zip(robot.all_axes, servos, strict=True)):
            if axis == "p" and not servo.limits_current and math.isnan(servo.stall_current_a):
                raise ControlTableError(
                    f"{robot.joint_label(joint)}: {robot.servo_models[joint]} has no current-based "
                    "position control, so its output is limited as a share of the stall current; "
                    "its file gives none: docs/how-to/add-a-servo-model.md"
                )
        return JointUnits(
            np.array(zero, np.int32),
            sign * step_rad,
            sign * np.array([servo.rad_s_per_velocity for servo in servos]),
            sign * np.array([servo.a_per_current for servo in servos]),
            np.array([(z - h, z + h) for z, h in zip(zero, half, strict=True)], np.int32),
            np.array([servo.measures_current for servo in servos]),
            np.array([servo.limits_current for servo in servos]),
            np.array([servo.stall_current_a for servo in servos]),
            np.array([servo.full_pwm for servo in servos], np.int32),
            np.array(
                [
                    servo.limits_current and (can_hold or axis == "p")
                    for axis, servo in zip(robot.all_axes, servos, strict=True)
                ]
            ),
        )

    def position_rad(self, joint: int, raw: int) -> float:
        """Angle of one joint, rad; 0 is straight."""
        return float((raw - self.zero_position[joint]) * self.rad_per_position[joint])

    def current_raw(self, joint: int, current_a: float) -> int:
        """Nearest raw value of a joint's current limit."""
        return round(current_a / abs(float(self.a_per_current[joint])))

    def pwm_raw(self, joint: int, current_a: float, most: int) -> int:
        """Goal PWM, 1 to ``most``, at which a joint at rest draws ``current_a``."""
        full_a = float(self.stall_current_a[joint])
        if not self.measures_current[joint]:
            full_a = abs(float(self.a_per_current[joint])) / LOAD_UNIT
        return min(most, max(1, round(float(self.full_pwm[joint]) * current_a / full_a)))


class GoalEncoder:
    """Converts J goals to raw positions within the joint limits."""

    def __init__(self, units: JointUnits) -> None:
        self._low, self._high = np.ascontiguousarray(units.limits_raw.T, np.int32)
        self._scale = np.stack([units.rad_per_position, units.zero_position.astype(np.float64)])

    def encode(self, goal_rad: Floats) -> Int32s:
        """(J,) raw goals, a new array.

        Raises:
            ValueError: a goal is not finite, or the shape is wrong.

        """
        if goal_rad.shape != self._low.shape:
            raise ValueError(f"goals of shape {goal_rad.shape} for {len(self._low)} joints")
        raw: Int32s = np.empty_like(self._low)
        if not encode_goals(goal_rad, self._scale, self._low, self._high, raw):
            raise ValueError("an angle is not finite")
        return raw


@compiled(
    f"boolean({_GOALS}, float64[:, ::1], int32[::1], int32[::1], int32[::1])", makes_arrays=False
)
def encode_goals(goal_rad: Floats, scale: Floats, low: Int32s, high: Int32s, raw: Int32s) -> bool:
    """Nearest positions of goals (J,) within ``low`` to ``high``; False if a goal is not finite.

    ``scale`` (2, J) is rad per position and the position of 0 rad. The position is rounded before
    the zero is added, so that a reversed servo gets the exact mirror image.
    """
    for joint in range(len(goal_rad)):
        if not np.isfinite(goal_rad[joint]):
            return False
        nearest = np.rint(goal_rad[joint] / scale[0, joint]) + scale[1, joint]
        raw[joint] = int(min(max(nearest, float(low[joint])), float(high[joint])))
    return True


class StateDecoder:
    """Decodes Present Current, Velocity and Position of all servos."""

    def __init__(self, tables: Iterable[ControlTable], units: JointUnits) -> None:
        """Check the layout of the registers.

        Raises:
            ControlTableError: it is not the layout of Protocol 2.0.

        """
        for table in tables:
            if table.facts.is_feetech:
                continue  # the bus converts the state
            registers = [table[name] for name in table.state_names]
            start = registers[0].address
            if [(r.address - start, r.size) for r in registers] != [(0, 2), (2, 4), (6, 4)]:
                raise ControlTableError(
                    [f"{table.model}: {', '.join(table.state_names)} do not lie in a row"]
                )
        self._zero = units.zero_position.astype(np.float64)
        self._scale = np.stack(
            [units.a_per_current, units.rad_s_per_velocity, units.rad_per_position]
        )

    def decode(self, data: Bytes, out: Floats) -> None:
        """Write current, A, velocity, rad/s, and position, rad, of (J, 10) to ``out`` (3, J)."""
        decode_state(data, self._zero, self._scale, out)


@compiled(f"int64({_BLOCKS}, int64, int64, int64)", makes_arrays=False)
def _signed_value(data: Bytes, row: int, offset: int, size: int) -> int:
    value = 0
    for k in range(size):
        value |= int(data[row, offset + k]) << (8 * k)
    half = 1 << (8 * size - 1)
    return value - 2 * half if value >= half else value


@compiled(f"void({_BLOCKS}, float64[::1], float64[:, ::1], float64[:, ::1])", makes_arrays=False)
def decode_state(data: Bytes, zero: Floats, scale: Floats, out: Floats) -> None:
    """Write current, velocity and position of blocks (J, 10) to ``out`` (3, J).

    ``scale`` (3, J) is per raw unit; ``zero`` (J,) is the position of 0 rad.
    """
    for row in range(len(data)):
        # 0 times a negative scale is -0; adding 0 makes it 0
        out[0, row] = _signed_value(data, row, 0, 2) * scale[0, row] + 0.0
        out[1, row] = _signed_value(data, row, 2, 4) * scale[1, row] + 0.0
        out[2, row] = (_signed_value(data, row, 6, 4) - zero[row]) * scale[2, row] + 0.0


def voltages_v(blocks: Bytes) -> Floats:
    """Supply (n,) of slow blocks (n, 3): Present Input Voltage is the first two bytes."""
    return np.asarray((blocks[:, 1].astype(np.uint16) << 8 | blocks[:, 0]) * VOLTAGE_UNIT_V)


class Readings:
    """Newest value of every quantity of J joints; NaN before the first."""

    def __init__(self, tables: Iterable[ControlTable], units: JointUnits) -> None:
        self._decoder = StateDecoder(tables, units)
        joints = len(units.zero_position)
        self._numbers = np.full((7, joints), np.nan)
        self._motion = self._numbers[:3]
        self._temperature, self._voltage = self._numbers[3:5]
        self._measured_at_s, self._slow_measured_at_s = self._numbers[5:]
        self._numbers[5:] = -np.inf
        self._hardware_error = np.zeros(joints, np.uint8)
        self._error = np.zeros(joints, np.uint8)
        self._valid = np.zeros(joints, np.bool_)
        self._alarmed = False
        self.alert = False
        """Whether a servo's newest reply says that it has an alarm."""
        self.slow_at_s = -math.inf
        """Time at which the oldest temperature and voltage were measured; -inf before the first."""
        self._flags = self._frozen_flags()

    def update(
        self, reply: GroupReadReply, measured_at_s: float, *, again: bool = False
    ) -> Sequence[int]:
        """Decode new state blocks; return the joints whose alarm (register 70) must be read.

        ``again``: a second read in this cycle; the first values stay current.
        """
        ok = reply.valid
        if reply.flawless and not self._alarmed:  # the regular case
            self._decoder.decode(reply.data, self._motion)
            self._measured_at_s.fill(measured_at_s)
            if ok is not self._valid:
                self._valid = ok
                self._flags = self._frozen_flags()
            return ()
        self._valid = ok | self._valid if again else ok
        motion = np.empty_like(self._motion)
        self._decoder.decode(reply.data, motion)
        self._motion[:, ok] = motion[:, ok]
        self._measured_at_s[ok] = measured_at_s
        self._error[reply.answered] = reply.error[reply.answered]
        self.alert = bool((self._error & ALERT).any())
        alert = (reply.error & ALERT) != 0
        self._hardware_error[reply.answered & ~alert] = 0  # without the alert bit register 70 is 0
        self._alarmed = bool(self._error.any() or self._hardware_error.any())
        self._flags = self._frozen_flags()
        return np.flatnonzero(alert & (self._hardware_error == 0)).tolist()

    def update_alarm(self, joint: int, hardware_error: int) -> None:
        """Store one joint's register 70."""
        self._hardware_error[joint] = hardware_error
        self._alarmed = True
        self._flags = self._frozen_flags()

    def dismiss_alert(self, joint: int) -> None:
        """Clear the alert bit of one joint's newest reply: register 70 shows no alarm."""
        self._error[joint] &= 0xFF ^ ALERT
        self.alert = bool((self._error & ALERT).any())
        self._flags = self._frozen_flags()

    def update_slow(self, reply: GroupReadReply, measured_at_s: float) -> None:
        """Decode the slow blocks: Present Input Voltage (2 bytes), Present Temperature (1)."""
        ok = slice(None) if reply.flawless else reply.valid  # indexing rows needs 30 us
        self._voltage[ok] = voltages_v(reply.data[ok])
        self._temperature[ok] = reply.data[ok, 2]
        self._slow_measured_at_s[ok] = measured_at_s
        self.slow_at_s = float(self._slow_measured_at_s.min())

    @property
    def temperature_c(self) -> Floats:
        """(J,) newest temperatures."""
        return np.asarray(self._temperature)

    @property
    def motion(self) -> Floats:
        """(3, J) newest currents, velocities and positions."""
        return self._motion

    @property
    def current_a(self) -> Floats:
        """(J,) newest currents."""
        return np.asarray(self._motion[0])

    def state(self, now_s: float) -> JointState:
        """Read-only copies of all values."""
        numbers = np.empty_like(self._numbers)
        _copy(self._numbers, now_s, numbers)
        numbers.setflags(write=False)
        current, velocity, position, temperature, voltage, age_s, slow_age_s = numbers
        hardware_error, error, valid = self._flags
        return JointState(  # positional: keywords need three times as long
            now_s,
            position,
            velocity,
            current,
            temperature,
            voltage,
            hardware_error,
            error,
            age_s,
            valid,
            slow_age_s,
        )

    def _frozen_flags(self) -> tuple[Bytes, Bytes, Bools]:
        """Read-only copies of rarely changing values; the same objects until they change."""
        return _frozen(self._hardware_error), _frozen(self._error), _frozen(self._valid)


@compiled("void(float64[:, ::1], float64, float64[:, ::1])", makes_arrays=False)
def _copy(numbers: Floats, now_s: float, copy: Floats) -> None:
    """Copy (7, J); the last two rows become ages."""
    for joint in range(numbers.shape[1]):
        for row in range(5):
            copy[row, joint] = numbers[row, joint]
        copy[5, joint] = now_s - numbers[5, joint]
        copy[6, joint] = now_s - numbers[6, joint]


def _frozen(array: NDArray[S]) -> NDArray[S]:
    copy = array.copy()
    copy.setflags(write=False)
    return copy
