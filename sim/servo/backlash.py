"""Backlash: play of the gears between the motor and the measured shaft.

Rotor and shaft are two inertias. They turn as one while the torque in the teeth presses one side
together. Otherwise the rotor turns freely in the gap, with the friction of the gears, and the shaft
without the motor. When the gap closes, both continue with their common momentum (an impact without
rebound; Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988).
"""

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.sim.servo.motor import friction_n_m

GAP = 0
SPEED = 1
SIDE = 2
"""Rows of the state: angle of the rotor from the middle of the gap, rotor's speed, and side of the
tooth that touches (1: the motor is ahead, -1: behind, 0: none)."""
KICK = 3
KICKED = 4
"""Rows of a MuJoCo joint besides: speed by which the rotor was faster when the gap closed, until it
acts, and until it is taken into account."""
BACKLASH = 12
"""Row of the backlash among the fields of a ``Gearbox``."""
WHEEL_SHARE = 0.02
"""Share of the armature on the shaft's side of the gap: the last wheel (ours)."""
LEAST_ROTOR_KG_M2 = 1e-7
"""Inertia of a rotor whose gearbox has none (ours)."""


@compiled(
    f"float64({readonly_array()}, float64, float64, float64, float64, float64)",
)
def free_rotor(
    gear: Floats,
    h: float,
    inertia_kg_m2: float,
    speed_rad_s: float,
    push_n_m: float,
    damping_n_m_s: float,
) -> float:
    """Speed of a rotor in the gap after ``h`` under ``push - damping * speed``.

    ``damping_n_m_s`` includes the viscous friction of ``gear`` (13,).
    """
    effective_inertia = inertia_kg_m2 + h * damping_n_m_s
    free = (inertia_kg_m2 * speed_rad_s + h * push_n_m) / effective_inertia
    motor_n_m = push_n_m - (damping_n_m_s - gear[2]) * speed_rad_s
    rest = abs(free) - h * friction_n_m(gear, speed_rad_s, motor_n_m, 0.0) / effective_inertia
    if rest <= 0.0:
        return 0.0
    return rest if free > 0.0 else -rest


@compiled(
    f"UniTuple(float64, 2)({readonly_array()}, float64[:], float64, float64, float64, float64,"
    " float64, float64, float64, float64)"
)
def turn_with_backlash(
    gear: Floats,
    play: Floats,
    h: float,
    shaft_kg_m2: float,
    rotor_kg_m2: float,
    before_rad_s: float,
    joined_rad_s: float,
    push_n_m: float,
    damping_n_m_s: float,
    load_n_m: float,
) -> tuple[float, float]:
    """Speed of a shaft after a step, and its additional turn over ``h``.

    Args:
        gear: (13,) fields of a ``Gearbox``.
        play: (3,) state, written: ``GAP``, ``SPEED``, ``SIDE``.
        h: length of the step.
        shaft_kg_m2: inertia of the shaft and its load.
        rotor_kg_m2: inertia of rotor and gears at the shaft.
        before_rad_s: the shaft's speed before the step.
        joined_rad_s: its speed after the step if rotor and shaft turn as one.
        push_n_m: the motor's torque at rest.
        damping_n_m_s: its loss per rotor speed, viscous friction included.
        load_n_m: torque of the load on the shaft.

    """
    half = 0.5 * gear[BACKLASH]
    if play[SIDE] != 0.0:
        tooth_n_m = shaft_kg_m2 * (joined_rad_s - before_rad_s) / h - load_n_m
        if play[SIDE] * tooth_n_m >= 0.0:
            play[SPEED] = joined_rad_s
            return joined_rad_s, 0.0
        play[SIDE] = 0.0
    rotor = free_rotor(gear, h, rotor_kg_m2, play[SPEED], push_n_m, damping_n_m_s)
    shaft = before_rad_s + h * load_n_m / shaft_kg_m2
    gap = play[GAP] + h * (rotor - shaft)
    if abs(gap) < half:
        play[GAP], play[SPEED] = gap, rotor
        return shaft, 0.0
    side = 1.0 if gap > 0.0 else -1.0
    share = min(max((side * half - play[GAP]) / (gap - play[GAP]), 0.0), 1.0)
    common = (rotor_kg_m2 * rotor + shaft_kg_m2 * shaft) / (rotor_kg_m2 + shaft_kg_m2)
    play[GAP], play[SPEED], play[SIDE] = side * half, common, side
    return common, share * (shaft - common)
