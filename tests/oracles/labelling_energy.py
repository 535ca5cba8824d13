"""Energy of a labelling, with which solvers are compared ([KP] 3.4.1)."""

import numpy as np

from snakewalk.config.arrays import Ints
from snakewalk.controller.mapping.mosaic.labelling import Costs


def energy(costs: Costs, base: Ints, penalty: float, labels: Ints) -> float:
    """``E(f)``: data terms of all labels, and Potts terms of neighbours."""
    window = costs.shape[3] * costs.shape[4]
    wide = costs.shape[4]
    has = labels >= 0
    flat = costs.reshape(*costs.shape[:2], -1)
    data = np.take_along_axis(flat, np.maximum(labels, 0)[..., None], axis=2)[..., 0]
    place = np.stack([labels % wide, labels % window // wide], axis=-1) + base
    unequal = 0
    for axis in (0, 1):
        parts = (slice(None, -1), slice(1, None))
        first_place, two = (np.moveaxis(place, axis, 0)[part] for part in parts)
        scale_one, scale_two = (np.moveaxis(labels // window, axis, 0)[part] for part in parts)
        both = np.logical_and(*(np.moveaxis(has, axis, 0)[part] for part in parts))
        unequal += int(((first_place != two).any(axis=-1) | (scale_one != scale_two))[both].sum())
    return float(data[has].sum()) + penalty * unequal
