"""A servo that swings a weight, computed from its constants: quick enough to be run for a fit."""

import math

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.controller.app.identification.pendulum_log import PendulumLog
from snakewalk.drivers.compiling import compiled, readonly_array

FINE_S = 1e-3
"""Longest step of a result (ours); half of it moves no angle of the XL330's logs by 0.004 rad."""
_ROW = readonly_array(layout="C")


def swing_rad(values: Floats, log: PendulumLog, step_s: float = FINE_S) -> Floats:
    """(N,) angles at the times of a log, from its first one at rest.

    Args:
        values: of ``servo_constants.CONSTANTS``.
        log: goals, supply and torque, each in force from its time on.
        step_s: longest step.

    """
    out = np.empty(len(log.time_s))
    _swing(
        values,
        *(log.time_s, log.goal_rad, log.supply_v, log.torque_on),
        *(log.position_rad[0], log.mass_kg, log.arm_m, log.p_gain, step_s),
        out,
    )
    return out


@compiled(
    f"void({_ROW}, {_ROW}, {_ROW}, {_ROW}, {_ROW}, float64, float64, float64, float64, float64,"
    " float64[::1])"
)
def _swing(
    values: Floats,
    time_s: Floats,
    goal_rad: Floats,
    supply_v: Floats,
    torque_on: Floats,
    start_rad: float,
    mass_kg: float,
    arm_m: float,
    p_gain: float,
    step_s: float,
    out: Floats,
) -> None:
    """Forces in the middle of a step; friction would stop the shaft in it, up to its greatest."""
    kt, resistance, armature, offset = values[0], values[1], values[2], values[3]
    dry, stribeck, by_motor, by_load = values[4], values[5], values[6], values[7]
    by_motor_slow, by_load_slow, slow_rad_s = values[8], values[9], values[10]
    exponent, viscous, p_unit, delay_s = values[11], values[12], values[13], values[14]
    by_motor_square, by_load_square = values[15], values[16]
    inertia = mass_kg * arm_m * arm_m + armature
    weight_n_m = mass_kg * GRAVITY_M_S2 * arm_m
    q, w, heard = start_rad, 0.0, 0
    out[0] = q
    for k in range(1, len(time_s)):
        span_s = time_s[k] - time_s[k - 1]
        steps = max(1, math.ceil(span_s / step_s))
        h = span_s / steps
        for i in range(steps):
            begin_s = time_s[k - 1] + i * h - delay_s
            while heard + 1 < len(time_s) and time_s[heard + 1] <= begin_s:
                heard += 1
            goal = goal_rad[heard]
            if heard + 1 < len(time_s):  # a new one may come within the step
                share = (begin_s + h - time_s[heard + 1]) / h
                goal += max(share, 0.0) * (goal_rad[heard + 1] - goal)
            q += 0.5 * h * w
            load = -weight_n_m * math.sin(q + offset)
            push = damping = 0.0
            if torque_on[k - 1] > 0.0:
                duty = min(max(p_gain * p_unit * (goal - q), -1.0), 1.0)
                push, damping = kt / resistance * duty * supply_v[k - 1], kt * kt / resistance
            motor = push - damping * w
            slow = math.exp(-((abs(w) / slow_rad_s) ** exponent))
            friction = dry + abs(by_load * load - by_motor * motor) + viscous * abs(w)
            friction += slow * (stribeck + abs(by_load_slow * load - by_motor_slow * motor))
            if load * motor < 0.0:
                stronger = abs(load) < abs(motor)
                square = by_load_square * load**2 if stronger else by_motor_square * motor**2
                friction += slow * square
            half = 0.5 * h * damping / inertia
            free = ((1.0 - half) * w + h * (push + load) / inertia) / (1.0 + half)
            rest = abs(free) - h * friction / (inertia * (1.0 + half))
            w = math.copysign(rest, free) if rest > 0.0 else 0.0
            q += 0.5 * h * w
        out[k] = q
