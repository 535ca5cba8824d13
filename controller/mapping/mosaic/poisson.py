"""Maps that keep the gradients of a model and continue given values ([KP] Eq. 5 to 7)."""

import numpy as np
from scipy.sparse import coo_array, csgraph
from scipy.sparse.linalg import splu

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.terrain.elevation_map import laplacian


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
    index = np.where(unknown, np.cumsum(unknown).reshape(unknown.shape) - 1, -1)
    count = int(unknown.sum())
    if count == 0 or not given.any():
        return out
    offset = np.where(given[..., None], values - shape, 0.0)
    weight = np.zeros(count)
    right = np.zeros((count, shape.shape[-1]))
    pairs = []
    for axis in (0, 1):
        parts = (slice(None, -1), slice(1, None))
        low, high = (np.moveaxis(index, axis, 0)[part] for part in parts)
        low_given, high_given = (np.moveaxis(given, axis, 0)[part] for part in parts)
        low_offset, high_offset = (np.moveaxis(offset, axis, 0)[part] for part in parts)
        for known_index, other, known_offset in (
            (low, high_given, high_offset),
            (high, low_given, low_offset),
        ):
            edge = (known_index >= 0) & other
            np.add.at(weight, known_index[edge], 1.0)
            np.add.at(right, known_index[edge], known_offset[edge])
        both = (low >= 0) & (high >= 0)
        pairs.append(np.stack([low[both], high[both]]))
    low, high = np.concatenate(pairs, axis=1)
    links = coo_array((np.ones(len(low)), (low, high)), shape=(count, count))
    _, part_of = csgraph.connected_components(links, directed=False)
    bordered = np.bincount(part_of, weights=weight)[part_of] > 0.0
    weight = weight + np.bincount(low, minlength=count) + np.bincount(high, minlength=count)
    weight[weight == 0.0] = 1.0
    matrix = laplacian(weight, low, high)
    kept = np.flatnonzero(bordered)
    solved = np.zeros_like(right)
    if len(kept):
        part = matrix[kept][:, kept].tocsc()
        solved[kept] = splu(part, permc_spec="MMD_AT_PLUS_A").solve(right[kept])
    out[unknown] += solved
    return out
