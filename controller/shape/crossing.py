"""Whether a body touches itself: a thick curve against its own other parts."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_POINTS = 50


def self_touches(skeleton_rad: Floats, length_m: float, radius_m: float) -> NDArray[np.bool_]:
    """Whether each body (S, N) of ``length_m`` and ``radius_m`` comes within its own thickness.

    Two points count when they are nearer than a diameter in the plane though more than a half
    circle of that diameter, and half again, apart along the body.
    """
    shapes = np.atleast_2d(skeleton_rad)
    step = shapes.shape[1] / _POINTS
    at = ((np.arange(_POINTS) + 0.5) * step).astype(int)
    angles = shapes[:, at]
    piece = length_m / _POINTS
    x = np.cumsum(np.cos(angles), axis=1) * piece
    y = np.cumsum(np.sin(angles), axis=1) * piece
    apart = np.abs(np.subtract.outer(np.arange(_POINTS), np.arange(_POINTS))) * piece
    i, j = np.nonzero(np.triu(apart > 1.5 * np.pi * radius_m))
    near = np.hypot(x[:, i] - x[:, j], y[:, i] - y[:, j]) < 2.0 * radius_m
    return np.asarray(near.any(axis=1))
