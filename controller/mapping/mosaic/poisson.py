"""Maps that keep the gradients of a model and continue given values ([KP] Eq. 5 to 7)."""

import numpy as np
from scipy.sparse import csgraph
from scipy.sparse.linalg import splu

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.terrain.elevation_map import LaplaceSystem


def continued(values: Floats, given: Bools, shape: Floats) -> Floats:
    """Solve ``min sum |grad Z - grad shape|^2`` with Z given on a part of the grid.

    The difference of Z and the shape is harmonic: each unknown value is the mean of its neighbours.
    A part without a bordering given value keeps the shape.

    Args:
        values: (H, W, k) maps; read where given.
        given: (H, W) pixels with values.
        shape: (H, W, k) maps with the gradients; NaN outside the grid.

    Returns:
        (H, W, k) maps; NaN outside the grid.

    """
    inside = np.isfinite(shape).all(axis=-1)
    given = given & inside & np.isfinite(values).all(axis=-1)
    unknown = inside & ~given
    out = np.where(given[..., None], values, shape)
    if not unknown.any() or not given.any():
        return out
    system = LaplaceSystem.of(unknown, given, values - shape)
    matrix = system.matrix()
    _, part_of = csgraph.connected_components(matrix, directed=False)
    kept = np.flatnonzero(np.bincount(part_of, weights=system.border_count)[part_of])
    solved = np.zeros_like(system.border_sum)
    if len(kept):
        part = matrix[kept][:, kept].tocsc()
        solved[kept] = splu(part, permc_spec="MMD_AT_PLUS_A").solve(system.border_sum[kept])
    out[unknown] += solved
    return out
