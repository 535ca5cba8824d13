"""Motors and gearboxes of servos, from the files of their models and of the robot.

A model's file has torque, current and speed at the recommended voltage; other constants are derived
here. Thermal figures are ours; they only determine when a hot servo shuts down.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import AnyInts, Floats
from snakewalk.config.motor import MotorConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.register_rules import motor_row, simulated_models

V = TypeVar("V")

_RPM = math.tau / 60.0


@dataclass(frozen=True, slots=True)
class MotorModel:
    """Motor of one servo model."""

    nominal_v: float
    stall_torque_n_m: float
    stall_current_a: float
    no_load_rad_s: float
    current_unit_a: float
    """Ampere of one unit of Present Current(126)."""
    p_gain_divisor: float
    standby_a: float
    winding_k_per_w: float
    """Heating of the housing sensor in the long run, kelvin per watt of I^2 R (ours)."""
    thermal_time_s: float
    """Time constant of the winding's heating (ours)."""
    positions_per_rad: float
    full_pwm: float
    """Goal PWM of full output."""

    @staticmethod
    def of(facts: ServoModel) -> "MotorModel":
        """Motor of a model.

        Raises:
            ControlTableError: the model cannot be simulated.

        """
        motor = motor_row(facts)
        units = facts.units
        return MotorModel(
            motor.nominal_v,
            motor.stall_torque_n_m,
            motor.stall_current_a,
            motor.no_load_rpm * _RPM,
            motor.stall_current_a * 1e-3 if units.current_a is None else units.current_a,
            motor.p_gain_divisor,
            motor.standby_a,
            motor.winding_k_per_w,
            motor.thermal_time_s,
            facts.positions_per_rad,
            float(units.full_pwm or 1),
        )

    @property
    def resistance_ohm(self) -> float:
        """At stall the winding drops the whole supply."""
        return self.nominal_v / self.stall_current_a

    @property
    def torque_constant_n_m_a(self) -> float:
        """k_t at the output shaft, gear losses included."""
        return self.stall_torque_n_m / self.stall_current_a

    @property
    def back_emf_v_s(self) -> float:
        """k_e in V s/rad: at no-load speed the back-EMF is the supply."""
        return self.nominal_v / self.no_load_rad_s

    def with_constants(self, motor: MotorConfig | None) -> "MotorModel":
        """The motor with the constants of a robot's file."""
        if motor is None:
            return self
        k_t, k_e = self.torque_constant_n_m_a, self.back_emf_v_s
        if motor.torque_constant_n_m_a is not None:  # one winding: both are equal
            k_t = k_e = motor.torque_constant_n_m_a
        stall_a = self.nominal_v / (motor.resistance_ohm or self.resistance_ohm)
        divisor = self.p_gain_divisor
        if motor.p_unit_per_rad is not None:
            divisor = self.positions_per_rad / self.full_pwm / motor.p_unit_per_rad
        return replace(
            self,
            stall_torque_n_m=k_t * stall_a,
            stall_current_a=stall_a,
            no_load_rad_s=self.nominal_v / (motor.back_emf_v_s or k_e),
            p_gain_divisor=divisor,
        )


class _ByName(Mapping[str, V]):
    """Values of the shipped models that can be simulated, made on look-up."""

    def __init__(self, make: Callable[[ServoModel], V | None]) -> None:
        self._make = make

    def __getitem__(self, name: str) -> V:
        facts = servo_model(name) if name in simulated_models() else None
        value = None if facts is None else self._make(facts)
        if value is None:
            raise KeyError(name)
        return value

    def __iter__(self) -> Iterator[str]:
        return (name for name in simulated_models() if self._make(servo_model(name)) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)


MOTORS: Mapping[str, MotorModel] = _ByName(MotorModel.of)
"""Motors by name of the model."""


def known_motors(robot: RobotConfig) -> list[MotorModel | None]:
    """Motors of a robot's J servos, with the constants of its file; None if unknown."""
    models = zip(robot.servo_records, robot.motors, strict=True)
    return [
        None if facts.motor is None else MotorModel.of(facts).with_constants(motor_config)
        for facts, motor_config in models
    ]


def motors_of(robot: RobotConfig) -> list[MotorModel]:
    """Motors of a robot's J servos.

    Raises:
        ControlTableError: a model cannot be simulated.

    """
    models = zip(robot.servo_records, robot.motors, strict=True)
    return [MotorModel.of(facts).with_constants(motor_config) for facts, motor_config in models]


class MotorColumns:
    """Constants of the motors of S servos, (S,) each."""

    def __init__(self, motors: Sequence[MotorModel]) -> None:
        def column(name: str) -> Floats:
            return np.array([getattr(motor, name) for motor in motors], dtype=np.float64)

        self.nominal_v = column("nominal_v")
        self.stall_current_a = column("stall_current_a")
        self.no_load_rad_s = column("no_load_rad_s")
        self.current_unit_a = column("current_unit_a")
        self.p_gain_divisor = column("p_gain_divisor")
        self.standby_a = column("standby_a")
        self.winding_k_per_w = column("winding_k_per_w")
        self.thermal_time_s = column("thermal_time_s")
        self.resistance_ohm = column("resistance_ohm")
        self.torque_constant_n_m_a = column("torque_constant_n_m_a")
        self.back_emf_v_s = column("back_emf_v_s")
        self.positions_per_rad = column("positions_per_rad")
        self.full_pwm = column("full_pwm")


def p_gain_per_rad(register: int | AnyInts, motor: MotorModel | MotorColumns) -> Floats:
    """PWM fraction per radian of error for Position P Gain(84)."""
    gain = np.asarray(register, dtype=np.float64)
    return gain / motor.p_gain_divisor * motor.positions_per_rad / motor.full_pwm


def make_drive(motors: Sequence[MotorModel], supply_v: ArrayLike) -> ServoDrive:
    """Make a drive of J servos at rest: torque off, zero goals and gains."""
    joints = len(motors)
    columns = MotorColumns(motors)
    return ServoDrive(
        torque_on=np.zeros(joints),
        goal_rad=np.zeros(joints),
        p_gain_per_rad=np.zeros(joints),
        pwm_limit=np.ones(joints),
        supply_v=np.full(joints, supply_v, dtype=np.float64),
        resistance_ohm=columns.resistance_ohm,
        torque_constant_n_m_a=columns.torque_constant_n_m_a,
        back_emf_v_s=columns.back_emf_v_s,
        current_limit_a=np.full(joints, np.inf),
    )


@dataclass(frozen=True, slots=True)
class Gearbox:
    """Friction and inertia of a gearbox at the output shaft; numbers, or (J,) of J servos.

    The greatest friction torque is ``dry + |by_load t_load - by_motor t_motor|``: teeth press
    harder under load, most if motor and load oppose each other. A slow shaft has an additional
    ``stribeck + |by_load_slow t_load - by_motor_slow t_motor|``, times ``exp(-(|w| /
    stribeck_rad_s)^stribeck_exponent)``. If motor and load oppose each other, the slow share also
    has ``by_load_square t_load^2`` while the motor is stronger, ``by_motor_square t_motor^2`` while
    the load is. (Duclusaud et al., "Extended Friction Models for the Physics Simulation of Servo
    Actuators", ICRA 2025: models M1 to M6.) Friction never reverses a shaft; a shaft that it can
    hold rests.
    """

    armature_kg_m2: Floats | float
    """Inertia of the rotor as seen through the gears."""
    dry_n_m: Floats | float
    viscous_n_m_s: Floats | float
    stribeck_n_m: Floats | float
    stribeck_rad_s: Floats | float
    by_motor: Floats | float
    """Share of the motor's torque that friction consumes."""
    by_load: Floats | float
    """Share of the load's torque that friction consumes."""
    by_load_slow: Floats | float
    """Additional share of the load's torque that friction consumes while the shaft is slow."""
    by_motor_slow: Floats | float = 0.0
    stribeck_exponent: Floats | float = 2.0
    by_motor_square: Floats | float = 0.0
    by_load_square: Floats | float = 0.0
    """Share of the load's torque that friction consumes, per unit of this torque, 1/(N m)."""
    backlash_rad: Floats | float = 0.0
    """Play of the shaft from end to end while the rotor rests (``sim.servo.backlash``)."""

    @staticmethod
    def columns(gears: "Sequence[Gearbox]") -> "Gearbox":
        """Gearboxes of J servos as one of (J,) columns."""
        names = [field.name for field in fields(Gearbox)]
        return Gearbox(*(np.array([getattr(gear, name) for gear in gears]) for name in names))

    def rows(self) -> Floats:
        """(13, J) fields in order, for ``friction_n_m``."""
        return np.array([np.atleast_1d(getattr(self, field.name)) for field in fields(self)], float)


@compiled(f"float64({readonly_array()}, float64, float64, float64)")
def friction_n_m(gear: Floats, speed_rad_s: float, motor_n_m: float, load_n_m: float) -> float:
    """Greatest friction torque without the viscous part.

    ``gear`` (13,) has the fields of a ``Gearbox`` in order.
    """
    friction = gear[1] + abs(gear[6] * load_n_m - gear[5] * motor_n_m)
    slow = gear[3] + abs(gear[7] * load_n_m - gear[8] * motor_n_m)
    if load_n_m * motor_n_m < 0.0:
        if abs(load_n_m) < abs(motor_n_m):
            slow += gear[11] * load_n_m * load_n_m
        else:
            slow += gear[10] * motor_n_m * motor_n_m
    if slow > 0.0:
        friction += slow * np.exp(-((abs(speed_rad_s) / gear[4]) ** gear[9]))
    return float(friction)


def measured_gearbox(facts: ServoModel) -> Gearbox | None:
    """Gearbox of a model with measured friction; None without."""
    friction = facts.friction
    if friction is None:
        return None
    return Gearbox(
        friction.armature_kg_m2,
        friction.dry_n_m,
        friction.viscous_n_m_s,
        friction.stribeck_n_m,
        friction.stribeck_rad_s,
        friction.by_motor,
        friction.by_load,
        friction.by_load_slow,
    )


GEARBOXES: Mapping[str, Gearbox] = _ByName(measured_gearbox)
"""Gearboxes of the models with measured friction."""


def gears_of(robot: RobotConfig) -> list[Gearbox]:
    """Gearboxes of a robot's J servos from its file; without friction by default."""
    terms = [
        Gearbox(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        if friction is None
        else Gearbox(
            0.0,
            friction.dry_n_m,
            0.0,
            friction.stribeck_n_m,
            friction.stribeck_rad_s,
            friction.by_motor,
            friction.by_load,
            friction.by_load_slow,
            friction.by_motor_slow,
            friction.stribeck_exponent,
            friction.by_motor_square,
            friction.by_load_square,
            friction.backlash_rad,
        )
        for friction in robot.motors
    ]
    inertia_and_drag = zip(robot.armatures_kg_m2, robot.gear_drags_n_m_s, strict=True)
    return [
        replace(gear, armature_kg_m2=armature, viscous_n_m_s=drag)
        for gear, (armature, drag) in zip(terms, inertia_and_drag, strict=True)
    ]
