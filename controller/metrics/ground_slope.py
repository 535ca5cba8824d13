"""Slope of the ground under the body over time, and the share of the walk on wide waves."""

from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.runlog.record import RunRecord


class GroundSlope(NamedTuple):
    """Slope of the ground under bodies, mean over the links; NaN where the pose is unknown."""

    ahead_rad: Floats
    """(P,) from the tail to the head; positive uphill."""
    steepest_rad: Floats
    """(P,) steepest slope under the links, rad."""


def ground_slope(ground: HeightField, links_m: Floats) -> GroundSlope:
    """Return the slope of the ground under centres of links (P, L, 3)."""
    x, y = links_m[..., 0], links_m[..., 1]
    is_known = np.isfinite(x).all(axis=1) & np.isfinite(y).all(axis=1)
    gradient = np.full((len(links_m), 2), np.nan)
    gradient[is_known] = np.stack(ground.gradient(x[is_known], y[is_known]), axis=-1).mean(axis=1)
    ahead = links_m[:, 0, :2] - links_m[:, -1, :2]
    ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    return GroundSlope(np.arctan((gradient * ahead).sum(axis=1)), np.arctan(np.hypot(*gradient.T)))


def carrier_share(record: RunRecord) -> float:
    """Return the share of the decisions that ride on a wide wave; NaN if the log does not say."""
    carrier_rad = record.walk.carrier_rad
    is_known = np.isfinite(carrier_rad)
    return float((carrier_rad[is_known] > 0.0).mean()) if is_known.any() else float("nan")
