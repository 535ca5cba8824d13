"""Footfall: motion of a foot backwards on the ground and forwards in the air, over a cycle.

Correction of [GC] 2.2.2, Eq. 9-10: there one ``T_y`` gives the height of both feet. Here each foot
has its own phase, and the share of the cycle on the ground is free.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics import smoothstep


def swing(cycle_share: Floats, duty: float | Floats) -> Floats:
    """Return 1 at touchdown, linear to -1 at lift-off, then back; continuous in speed.

    Args:
        cycle_share: (...) cycles since touchdown, 0 to 1.
        duty: share of a cycle on the ground, 0 to 1; a scalar or one value per ``cycle_share``.

    """
    ground = 1.0 - 2.0 * cycle_share / duty
    air = _air(cycle_share, duty)
    slope = -2.0 * (1.0 - duty) / duty  # slope at both ends of the air, as on the ground
    back = 2.0 * smoothstep.cubic(air) - 1.0 + slope * air * (1.0 - air) * (1.0 - 2.0 * air)
    return np.where(cycle_share < duty, ground, back)


def lift(cycle_share: Floats, duty: float) -> Floats:
    """Return 0 on the ground, 1 in the middle of the air; arguments as in ``swing``."""
    return np.sin(0.5 * TURN * _air(cycle_share, duty)) ** 2


def _air(cycle_share: Floats, duty: float | Floats) -> Floats:
    """Share of the air phase that has passed, 0 on the ground."""
    return np.clip((cycle_share - duty) / (1.0 - duty), 0.0, 1.0)
