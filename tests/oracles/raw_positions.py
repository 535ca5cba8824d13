"""Angles to raw positions, in numpy: what the compiled goal encoder must give within the limits."""

import numpy as np

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.drivers.protocol.registers import ServoUnits


def raw_positions(units: ServoUnits, angle_rad: Floats) -> Int32s:
    """Nearest raw positions of angles.

    Raises:
        ValueError: an angle is not finite.

    """
    if not np.isfinite(angle_rad).all():
        raise ValueError("an angle is not finite")
    return (np.rint(angle_rad / units.rad_per_position) + units.zero_position).astype(np.int32)
