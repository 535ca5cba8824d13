"""The feet of a cycle by [GC] Eq. 9 and 10: as printed, with separate phases, and planted.

    T_y = sin(w t),  T_z = cos(w t);   R_Fy = T_y (H + H_R) + H_RF,  R_Fz = -T_z (L + L_R)

The left foot has no minus sign. As printed both feet use one ``T_y``: both are in the air at the
same time, and the left one travels backwards while it is lifted. Each foot is also below its
initial height for half of the cycle.

``FeetLaw.PHASES`` delays the left foot's height by half a cycle, and stops both feet at the ground.
``FeetLaw.PLANTED`` also chooses the share of the cycle on the ground, where a foot keeps its place.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.people.feet_law import FeetLaw
from snakewalk.controller.gaits import footfall
from snakewalk.controller.gaits.wave import TURN


@dataclass(frozen=True, slots=True)
class FootParameters:
    """Parameters of Eq. 10, metres; those of one foot are zero by default, as in the paper."""

    height_m: float
    """H, height of a step."""
    length_m: float
    """L, half the length of a step over the trunk."""
    duty: float
    """Share of a cycle on the ground, of planted feet (ours)."""
    right_height_m: float = 0.0
    """H_R"""
    left_height_m: float = 0.0
    right_initial_m: float = 0.0
    """H_RF"""
    left_initial_m: float = 0.0
    right_length_m: float = 0.0
    """L_R"""
    left_length_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Feet:
    """Ways of the left and the right foot over T moments; index 0 is the left foot."""

    ahead_m: Floats
    """(T, 2) ahead of the trunk, z of the paper."""
    height_m: Floats
    """(T, 2) over the ground, y of the paper."""
    at: Floats
    """(T, 2) cycles since each foot came down, 0 to 1."""
    on_ground: Floats
    """(T, 2) 1 on the ground, 0 in the air."""
    duty: float
    """Share of a cycle on the ground."""


def feet(law: FeetLaw, given: FootParameters, phase: Floats) -> Feet:
    """Return the feet at phases (T,) of the cycle, ``w t`` in cycles."""
    wt = TURN * np.asarray(phase, dtype=float)
    high = given.height_m + np.array([given.left_height_m, given.right_height_m])
    low = np.array([given.left_initial_m, given.right_initial_m])
    half = given.length_m + np.array([given.left_length_m, given.right_length_m])
    # a foot comes down where its way along z turns back: at w t = pi the right one, at 0 the left
    down = np.array([0.0, 0.5])
    foot_phase = (np.asarray(phase)[:, None] - down) % 1.0
    if law is FeetLaw.PLANTED:
        ahead = half * footfall.swing(foot_phase, given.duty)
        air = np.clip((foot_phase - given.duty) / (1.0 - given.duty), 0.0, 1.0)
        # Eq. 9 runs from 0 to pi in the air
        height = np.maximum(high * np.sin(0.5 * TURN * air) + low, 0.0)
        return Feet(ahead, height, foot_phase, (foot_phase < given.duty).astype(float), given.duty)
    ahead = half * np.stack([np.cos(wt), -np.cos(wt)], axis=-1)
    if law is FeetLaw.PRINTED:
        height = high * np.sin(wt)[:, None] + low
    else:
        height = np.maximum(high * np.stack([-np.sin(wt), np.sin(wt)], axis=-1) + low, 0.0)
    return Feet(ahead, height, foot_phase, (height <= low).astype(float), 0.5)
