"""A coiled body as a cylinder: about which line it winds, how far away and how far round."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Coil:
    """A cylinder through the links of a body."""

    axis: Floats
    """(3,) unit, from tail to head."""
    centre_m: Floats
    """(3,) on the axis, beside the middle of the body."""
    radius_m: Floats
    """(L,) distance of each link's centre from the axis."""
    wound_rad: float
    """How far the body goes round."""


def fit_coil(links_m: Floats) -> Coil:
    """Cylinder through points (L, 3) of a helix: least squares on the distances from its axis."""
    bends = np.diff(links_m, n=2, axis=0)
    axis = np.linalg.svd(bends)[2][2] if np.abs(bends).max() > 1e-9 else links_m[0] - links_m[-1]
    axis = axis / np.linalg.norm(axis)
    side = np.linalg.svd(axis[None])[2][1:]
    middle = links_m.mean(axis=0)

    def distances(x: Floats) -> Floats:
        away = links_m - middle - x[2:4] @ side
        line = axis + x[:2] @ side
        line = line / np.linalg.norm(line)
        return np.asarray(np.linalg.norm(away - (away @ line)[:, None] * line, axis=1))

    def spread(x: Floats) -> Floats:
        d = distances(x)
        return np.asarray(d - d.mean())

    start = np.zeros(4)
    if np.abs(bends).max() > 1e-9:
        start = least_squares(spread, start, x_scale=0.1).x
    line = axis + start[:2] @ side
    line /= np.linalg.norm(line)
    line *= math.copysign(1.0, float(line @ (links_m[0] - links_m[-1])))
    centre = middle + start[2:4] @ side
    around = np.linalg.svd(line[None])[2][1:]
    x, y = around @ (links_m - centre).T
    wound = np.unwrap(np.arctan2(y, x))
    winds = abs(float(wound[-1] - wound[0])) if np.hypot(x, y).min() > 1e-6 else 0.0
    return Coil(line, centre, distances(start), winds)
