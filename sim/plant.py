"""The interface between servos and mechanics.

Servos (``sim.servo``) write a ``ServoDrive``, one array per quantity, when registers change. A
``Plant`` (``sim.physics``, or a bench of bare shafts) owns the shafts, reads the drive in every
step, and writes back the motors' output.
"""

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig

_ENERGIES = ("drawn_j", "returned_j", "heat_j", "work_j")


@dataclass(frozen=True, slots=True)
class ServoDrive:
    """Quantities of J servos for the plant's steps; contiguous float64 arrays (J,).

    The arrays are written in place and never replaced: compiled steps keep their addresses.
    Position control of the firmware: ``pwm = clip(p_gain * (goal - q), +-pwm_limit)``, ``volts =
    pwm * supply``, ``i = (volts - k_e w) / R``, ``torque = k_t i``. In current-based mode the
    current is clipped to ``+-current_limit_a``. An unpowered bridge (``torque_on`` 0) is open: no
    current.
    """

    torque_on: Floats
    goal_rad: Floats
    p_gain_per_rad: Floats
    """PWM fraction per radian of position error."""
    pwm_limit: Floats
    """Fraction of the supply, 0..1."""
    supply_v: Floats
    resistance_ohm: Floats
    torque_constant_n_m_a: Floats
    """Torque constant k_t at the output shaft; k_e in V s/rad is the no-load voltage over speed."""
    back_emf_v_s: Floats
    current_limit_a: Floats
    """Limit of the current; infinite if the operating mode does not limit it."""
    # written by the plant, in its last step
    current_a: Floats = field(init=False)
    torque_n_m: Floats = field(init=False)
    pwm: Floats = field(init=False)
    # sums of the plant over all its steps
    drawn_j: Floats = field(init=False)
    """Electrical energy ``volts i`` that the motor consumed; returned energy is not deducted."""
    returned_j: Floats = field(init=False)
    """Electrical energy that the motor gave back."""
    heat_j: Floats = field(init=False)
    """Heat of the winding, ``i^2 R``, J."""
    work_j: Floats = field(init=False)
    """Net work of the torque at the shaft; negative where the load turned the motor."""

    def __post_init__(self) -> None:
        joints = len(self.torque_on)
        for output in ("current_a", "torque_n_m", "pwm", *_ENERGIES):
            object.__setattr__(self, output, np.zeros(joints))
        for column in self.columns():
            if (
                column.dtype != np.float64
                or column.shape != (joints,)
                or not column.flags.c_contiguous
            ):
                raise TypeError(f"a drive holds contiguous float64 arrays of {joints} joints")

    def columns(self) -> tuple[Floats, ...]:
        """All arrays, in field order."""
        return (
            self.torque_on,
            self.goal_rad,
            self.p_gain_per_rad,
            self.pwm_limit,
            self.supply_v,
            self.resistance_ohm,
            self.torque_constant_n_m_a,
            self.back_emf_v_s,
            self.current_limit_a,
            self.current_a,
            self.torque_n_m,
            self.pwm,
            self.drawn_j,
            self.returned_j,
            self.heat_j,
            self.work_j,
        )


@dataclass(frozen=True, slots=True)
class Mounting:
    """Mounting of S servos on the plant's shafts: ``servo angle = sign * shaft angle + zero``."""

    sign: Floats
    """(S,) -1 for a servo that turns against its shaft, else 1."""
    zero_rad: Floats
    """(S,) angle of the servo from its own zero when the shaft is at 0."""

    @staticmethod
    def of(robot: RobotConfig) -> "Mounting":
        """Mounting of the robot's file."""
        return Mounting(np.array(robot.signs, np.float64), np.array(robot.zeros_rad))


def shaft_torque(
    position_rad: float,
    velocity_rad_s: float,
    torque_on: float,
    goal_rad: float,
    p_gain_per_rad: float,
    pwm_limit: float,
    supply_v: float,
    resistance_ohm: float,
    torque_constant_n_m_a: float,
    back_emf_v_s: float,
    current_limit_a: float,
) -> tuple[float, float, float]:
    """PWM fraction, current, A, and torque, N m, of one servo by the law of ``ServoDrive``."""
    if torque_on <= 0.0:
        return 0.0, 0.0, 0.0
    pwm = min(max(p_gain_per_rad * (goal_rad - position_rad), -pwm_limit), pwm_limit)
    current = (pwm * supply_v - back_emf_v_s * velocity_rad_s) / resistance_ohm
    current = min(max(current, -current_limit_a), current_limit_a)
    return pwm, current, torque_constant_n_m_a * current


class LinkMotion(NamedTuple):
    """Pose of one link, for an IMU in it."""

    time_s: float
    centre_m: Floats
    """(3,) centre of the link in the world, m."""
    rotation: Floats
    """(3, 3) columns: forward, left and up axes in the world."""


class Plant(Protocol):
    """Mechanics with J shafts, stepped on demand."""

    @property
    def time_s(self) -> float:
        """Time of the shafts' state."""
        ...

    @property
    def position_rad(self) -> Floats:
        """(J,) shaft angles; the array may be a live view."""
        ...

    @property
    def velocity_rad_s(self) -> Floats:
        """(J,) rad/s."""
        ...

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step to the last whole step at or before ``until_s`` under ``drive``."""
        ...
