"""Motor constants by servo model, and what the registers make of them.

Torque, current and speed figures are those of the e-manual's specification tables at the voltage
that ROBOTIS recommends; everything else is derived from them here. Thermal figures are not
published: ours are marked, and only shape when a hot servo shuts down, not how it moves.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.plant import ServoDrive

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

TICKS_PER_REV = 4096
TICKS_PER_RAD = TICKS_PER_REV / math.tau
PWM_FULL = 885.0
"""Goal PWM(100): 885 is 100 %, e-manual."""


@dataclass(frozen=True, slots=True)
class MotorModel:
    """What the specification table says of one servo model."""

    nominal_v: float
    stall_torque_n_m: float
    stall_current_a: float
    no_load_rad_s: float
    current_unit_a: float
    """Ampere of one unit of Present Current(126)."""
    p_gain_divisor: float
    """K_P = Position P Gain(84) / divisor, in PWM units a tick of position error."""
    standby_a: float
    winding_k_per_w: float
    """Heating of the housing sensor in the long run, kelvin per watt of I^2 R (ours)."""
    thermal_time_s: float
    """Time constant of that heating (ours)."""

    @property
    def resistance_ohm(self) -> float:
        """All the supply drops over the winding at stall."""
        return self.nominal_v / self.stall_current_a

    @property
    def torque_constant_n_m_a(self) -> float:
        """k_t at the output shaft, gear losses included."""
        return self.stall_torque_n_m / self.stall_current_a

    @property
    def back_emf_v_s(self) -> float:
        """k_e in V s/rad: at no-load speed the back-EMF is the supply."""
        return self.nominal_v / self.no_load_rad_s


_RPM = math.tau / 60.0

MOTORS = {
    # e-manual XM430-W350, Specifications: 4.1 N m at 12.0 V and 2.3 A, 46 rev/min at 12.0 V,
    # standby 40 mA; Current Limit(38): about 2.69 mA a unit;
    # Position PID Gain: divisor 128.
    "XM430-W350": MotorModel(12.0, 4.1, 2.3, 46.0 * _RPM, 2.69e-3, 128.0, 0.040, 6.0, 300.0),
    # e-manual XL330-M288-T, Specifications: 0.52 N m at 5.0 V and 1.47 A, 103 rev/min at 5.0 V,
    # standby 17 mA; Current Limit(38): 1 mA a unit.
    # Divisor: the e-manual says 128 here too, but in recordings of a real one (Rhoban, bam) the
    # output follows the position error at gain / 256, r > 0.998 at three gains, up to 885.
    "XL330-M288": MotorModel(5.0, 0.52, 1.47, 103.0 * _RPM, 1.0e-3, 256.0, 0.017, 12.0, 150.0),
}


def p_gain_per_rad(register: int | Ints, motor: MotorModel) -> Floats:
    """PWM fraction per radian of position error for Position P Gain(84)."""
    gain = np.asarray(register, dtype=np.float64)
    return np.asarray(gain / motor.p_gain_divisor * TICKS_PER_RAD / PWM_FULL)


def make_drive(motors: list[MotorModel], supply_v: float) -> ServoDrive:
    """Make a drive of J servos at rest: torque off, goals 0, gains 0; registers set the rest."""

    def column(name: str) -> Floats:
        return np.array([getattr(motor, name) for motor in motors], dtype=np.float64)

    joints = len(motors)
    return ServoDrive(
        torque_on=np.zeros(joints),
        goal_rad=np.zeros(joints),
        p_gain_per_rad=np.zeros(joints),
        pwm_limit=np.ones(joints),
        supply_v=np.full(joints, supply_v),
        resistance_ohm=column("resistance_ohm"),
        torque_constant_n_m_a=column("torque_constant_n_m_a"),
        back_emf_v_s=column("back_emf_v_s"),
        current_limit_a=np.full(joints, np.inf),
    )
