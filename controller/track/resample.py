"""Resampling to equal arc lengths: a midline becomes 100 segments and tangent angles."""

import numpy as np
import scipy  # scipy.interpolate loads when it is first used

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.arc_length import arc_lengths

SEGMENTS = 100
"""Segments of a skeleton, [PT] 2.5."""
_FINE_STEPS = 8  # samples per segment to measure the spline's arc length


def equal_arc_length(points: Floats, segments: int = SEGMENTS) -> Floats:
    """Points (segments + 1, 2) at equal arc lengths on the cubic spline through (P, 2).

    First and last point are kept. Chords differ by about the square of the bend of one segment.

    Raises:
        ValueError: fewer than 4 distinct consecutive points.

    """
    chord = np.hypot(*np.diff(points, axis=0).T)
    distinct = np.concatenate([[True], chord > 1e-9 * chord.sum()])
    if distinct.sum() < 4:
        raise ValueError("a body needs 4 distinct points")
    kept = points[distinct]
    arc_px = arc_lengths(kept)
    spline = scipy.interpolate.make_interp_spline(arc_px, kept)
    fine = np.linspace(0.0, arc_px[-1], segments * _FINE_STEPS + 1)
    arc = arc_lengths(spline(fine))
    equal = np.interp(np.linspace(0.0, arc[-1], segments + 1), arc, fine)
    return np.asarray(spline(equal), dtype=float)


def tangent_angles(points: Floats) -> Floats:
    """Tangent angles (..., P - 1) of points (..., P, 2), head first, unwrapped along the body.

    The angle is the direction of travel: from each point to the one before it.
    """
    step = -np.diff(points, axis=-2)
    return np.unwrap(np.arctan2(step[..., 1], step[..., 0]), axis=-1)


def body_points(angles_rad: Floats, length: float = 1.0) -> Floats:
    """Points (..., N + 1, 2) of a body with tangent angles (..., N), its head tip at the origin.

    ``P(n) = P(n - 1) - r [cos Theta(n), sin Theta(n)]``, [PT] 2.6.4 with the base added once.
    """
    step = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)
    points = np.zeros((*step.shape[:-2], step.shape[-2] + 1, 2))
    points[..., 1:, :] = -np.cumsum(step, axis=-2) * (length / angles_rad.shape[-1])
    return points
