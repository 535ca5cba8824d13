"""A servo that swings a weight, computed from its constants: quick enough to be run for a fit.

The same with the simulated servo of a robot's file predicts a run of that robot.
"""

import math
from dataclasses import fields

import numpy as np

from snakewalk.config.arrays import Floats, Indices
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog
from snakewalk.controller.studies.identification.servo_constants import NAMES, ServoConstants
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.sim.servo.backlash import (
    BACKLASH,
    LEAST_ROTOR_KG_M2,
    SPEED,
    turn_with_backlash,
)
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import (
    Gearbox,
    friction_n_m,
    gears_of,
    make_drive,
    motors_of,
    p_gain_per_rad,
)

_GEAR: Indices = np.array([NAMES.index(field.name) for field in fields(Gearbox)])
FINE_S = 1e-3
"""Longest step of a result (ours); half of it moves no angle of the XL330's logs by 0.004 rad."""
_ROW = readonly_array(layout="C")


def robot_swing_rad(
    robot: RobotConfig, log: PendulumLog, bench: ServoConstants, step_s: float = FINE_S
) -> Floats:
    """(N,) angles at the times of a log, of the first servo that a robot's file describes.

    Args:
        robot: its motors and gears are the simulator's.
        log: goals, supply and torque.
        bench: offset and delay, which are of the pendulum's bench and in no robot's file.
        step_s: of the simulation.

    """
    motor = motors_of(robot)[0]
    gear = gears_of(robot)[0]
    weight_n_m = log.mass_kg * GRAVITY_M_S2 * log.arm_m
    plant = BenchPlant(
        1,
        inertia_kg_m2=log.mass_kg * log.arm_m**2,
        load_n_m=lambda q: -weight_n_m * np.sin(q + bench["offset_rad"]),
        start_rad=log.position_rad[0],
        gear=gear,
        step_s=step_s,
    )
    drive = make_drive([motor], log.supply_v[0])
    drive.p_gain_per_rad[:] = p_gain_per_rad(round(log.p_gain), motor)
    drive.current_limit_a[:] = log.current_limit_a
    drive.goal_rad[:] = log.goal_rad[0]
    out = np.empty_like(log.time_s)
    heard = 0
    last = len(log.time_s) - 1
    heard_s = log.time_s + bench["delay_s"]
    for k, until_s in enumerate(np.append(log.time_s[1:], log.time_s[-1])):
        out[k] = plant.position_rad[0]
        drive.torque_on[:] = log.torque_on[k]
        drive.supply_v[:] = log.supply_v[k]
        while heard < last and heard_s[heard + 1] <= until_s:
            heard += 1
            plant.advance(heard_s[heard], drive)
            drive.goal_rad[:] = log.goal_rad[heard]
        plant.advance(until_s, drive)
    return out


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
        values[_GEAR],
        log.time_s,
        log.goal_rad,
        log.supply_v,
        log.torque_on,
        log.position_rad[0],
        log.mass_kg,
        log.arm_m,
        log.p_gain,
        log.current_limit_a,
        step_s,
        out,
    )
    return out


@compiled(
    f"void({', '.join([_ROW] * 6)}, float64, float64, float64, float64, float64, float64,"
    " float64[::1])"
)
def _swing(
    values: Floats,
    gear: Floats,
    time_s: Floats,
    goal_rad: Floats,
    supply_v: Floats,
    torque_on: Floats,
    start_rad: float,
    mass_kg: float,
    arm_m: float,
    p_gain: float,
    current_limit_a: float,
    step_s: float,
    out: Floats,
) -> None:
    """Forces in the middle of a step; friction would stop the shaft in it, up to its greatest."""
    kt = values[0]
    resistance = values[1]
    armature = values[2]
    offset = values[3]
    viscous = values[12]
    p_unit = values[13]
    delay_s = values[14]
    shaft_kg_m2 = mass_kg * arm_m * arm_m
    inertia = shaft_kg_m2 + armature
    weight_n_m = mass_kg * GRAVITY_M_S2 * arm_m
    has_play = gear[BACKLASH] > 0.0
    play = np.zeros(3)
    rotor_kg_m2 = max(armature, LEAST_ROTOR_KG_M2)
    q = start_rad
    w = 0.0
    more = 0.0
    heard = 0
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
                push = kt / resistance * duty * supply_v[k - 1]
                damping = kt * kt / resistance
                amps = (push - damping * (play[SPEED] if has_play else w)) / kt
                if abs(amps) > current_limit_a:
                    push = math.copysign(kt * current_limit_a, amps)
                    damping = 0.0
            motor = push - damping * w
            friction = friction_n_m(gear, w, motor, load) + viscous * abs(w)
            half = 0.5 * h * damping / inertia
            free = ((1.0 - half) * w + h * (push + load) / inertia) / (1.0 + half)
            rest = abs(free) - h * friction / (inertia * (1.0 + half))
            before = w
            w = math.copysign(rest, free) if rest > 0.0 else 0.0
            if has_play:
                w, more = turn_with_backlash(
                    gear,
                    play,
                    h,
                    shaft_kg_m2,
                    rotor_kg_m2,
                    before,
                    w,
                    push,
                    damping + viscous,
                    load,
                )
                q += 0.5 * h * more
            q += 0.5 * h * w
        out[k] = q
