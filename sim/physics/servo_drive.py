"""What a servo's bridge and motor make of a goal: the law that ``ServoDrive`` documents."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.sim.plant import ServoDrive


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
    """Return (pwm fraction, current in A, torque in N m) of one servo."""
    if torque_on <= 0.0:
        return 0.0, 0.0, 0.0
    pwm = min(max(p_gain_per_rad * (goal_rad - position_rad), -pwm_limit), pwm_limit)
    current = (pwm * supply_v - back_emf_v_s * velocity_rad_s) / resistance_ohm
    current = min(max(current, -current_limit_a), current_limit_a)
    return pwm, current, torque_constant_n_m_a * current


def drive_shafts(drive: ServoDrive, position_rad: Floats, velocity_rad_s: Floats) -> Floats:
    """``shaft_torque`` of J servos at once: fills the drive's outputs, returns torque (J,), N m."""
    on = drive.torque_on > 0.0
    pwm = np.clip(
        drive.p_gain_per_rad * (drive.goal_rad - position_rad), -drive.pwm_limit, drive.pwm_limit
    )
    volts = pwm * drive.supply_v - drive.back_emf_v_s * velocity_rad_s
    limit = drive.current_limit_a
    drive.pwm[:] = np.where(on, pwm, 0.0)
    drive.current_a[:] = np.where(on, np.clip(volts / drive.resistance_ohm, -limit, limit), 0.0)
    drive.torque_n_m[:] = drive.torque_constant_n_m_a * drive.current_a
    return drive.torque_n_m
