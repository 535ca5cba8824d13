"""Footfall: how a foot goes back on the ground and forward in the air, over a cycle.

Correction of the cyclic legs of [GC] 2.2.2, Eq. 9-10: there both feet get their height from one
``T_y``. Here each foot has separate phases in height and way, and the share of the cycle that it is
on the ground is free.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics import smoothstep


def swing(at: Floats, duty: float | Floats) -> Floats:
    """1 where a foot comes down, evenly to -1 where it leaves, and back; no step in speed.

    Args:
        at: (...) cycles since the foot came down, 0 to 1.
        duty: share of a cycle on the ground, between 0 and 1; one, or one for each of ``at``.

    """
    ground = 1.0 - 2.0 * at / duty
    air = _air(at, duty)
    slope = -2.0 * (1.0 - duty) / duty  # at both ends of the air, as on the ground
    back = 2.0 * smoothstep.cubic(air) - 1.0 + slope * air * (1.0 - air) * (1.0 - 2.0 * air)
    return np.where(at < duty, ground, back)


def lift(at: Floats, duty: float) -> Floats:
    """0 on the ground, to 1 in the middle of the air; arguments as of ``swing``."""
    return np.sin(0.5 * TURN * _air(at, duty)) ** 2


def _air(at: Floats, duty: float | Floats) -> Floats:
    """Share of the air that has passed, 0 on the ground."""
    return np.clip((at - duty) / (1.0 - duty), 0.0, 1.0)
