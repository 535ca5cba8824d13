"""Resampling to equal arc lengths: points along a body become 100 segments and tangent angles."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled

SEGMENTS = 100
"""Segments of a skeleton, [PT] 2.5."""
_FINE = 8  # samples per segment when the spline's arc length is measured


@compiled("float64[::1](float64[::1], float64[::1])")
def _rates(chord: Floats, slope: Floats) -> Floats:
    """Derivatives (P,) of a cubic spline whose first two and last two pieces are one each."""
    count = len(chord) + 1
    middle, above, rate = np.empty(count), np.empty(count), np.empty(count)
    wide = chord[0] + chord[1]
    middle[0], above[0] = chord[1], wide
    rate[0] = ((chord[0] + 2.0 * wide) * chord[1] * slope[0] + chord[0] ** 2 * slope[1]) / wide
    for k in range(1, count):
        if k < count - 1:
            below, middle[k], above[k] = chord[k], 2.0 * (chord[k - 1] + chord[k]), chord[k - 1]
            rate[k] = 3.0 * (chord[k] * slope[k - 1] + chord[k - 1] * slope[k])
        else:
            wide = chord[-1] + chord[-2]
            below, middle[k] = wide, chord[-2]
            rate[k] = chord[-1] ** 2 * slope[-2] + (2.0 * wide + chord[-1]) * chord[-2] * slope[-1]
            rate[k] /= wide
        share = below / middle[k - 1]
        middle[k] -= share * above[k - 1]
        rate[k] -= share * rate[k - 1]
    rate[-1] /= middle[-1]
    for k in range(count - 2, -1, -1):
        rate[k] = (rate[k] - above[k] * rate[k + 1]) / middle[k]
    return rate


@compiled("float64[:, ::1](float64[::1], float64[:, ::1], float64[:, ::1], float64[::1])")
def _on_spline(at: Floats, points: Floats, rate: Floats, where: Floats) -> Floats:
    """Points (N, 2) at ``where`` (N,), ascending, of the spline with these values and rates."""
    found = np.empty((len(where), 2))
    piece = 0
    for k in range(len(where)):
        while piece < len(at) - 2 and where[k] >= at[piece + 1]:
            piece += 1
        chord, past = at[piece + 1] - at[piece], where[k] - at[piece]
        for axis in range(2):
            slope = (points[piece + 1, axis] - points[piece, axis]) / chord
            bend = (rate[piece, axis] + rate[piece + 1, axis] - 2.0 * slope) / chord
            curve = (slope - rate[piece, axis]) / chord - bend
            found[k, axis] = points[piece, axis] + past * (
                rate[piece, axis] + past * (curve + past * bend / chord)
            )
    return found


def equal_arc_length(points: Floats, segments: int = SEGMENTS) -> Floats:
    """Points (segments + 1, 2) at equal arc lengths on the cubic spline through ``points`` (P, 2).

    First and last point are kept. Arcs are equal, chords only nearly so: on 100 segments of a body
    they differ by about the square of the bend of one segment.

    Raises:
        ValueError: fewer than 4 distinct consecutive points.

    """
    chord = np.hypot(*np.diff(points, axis=0).T)
    distinct = np.concatenate([[True], chord > 1e-9 * chord.sum()])
    if int(distinct.sum()) < 4:
        raise ValueError("a body needs 4 distinct points")
    kept = np.ascontiguousarray(points[distinct], dtype=float)
    step = np.diff(kept, axis=0)
    chord = np.hypot(*step.T)
    at = np.concatenate([[0.0], np.cumsum(chord)])
    rate = np.column_stack([_rates(chord, along / chord) for along in step.T])
    fine = np.linspace(0.0, at[-1], segments * _FINE + 1)
    pieces = np.diff(_on_spline(at, kept, rate, fine), axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*pieces.T))])
    equal = np.interp(np.linspace(0.0, arc[-1], segments + 1), arc, fine)
    return np.asarray(_on_spline(at, kept, rate, equal))


def tangent_angles(points: Floats) -> Floats:
    """Tangent angles (..., P - 1) of points (..., P, 2), head first, unwrapped along the body.

    The angle is the direction of travel: from each point to the one before it.
    """
    step = -np.diff(points, axis=-2)
    return np.asarray(np.unwrap(np.arctan2(step[..., 1], step[..., 0]), axis=-1))


def body_points(angles_rad: Floats, length: float = 1.0) -> Floats:
    """Points (..., N + 1, 2) of a body with tangent angles (..., N), its head tip at the origin.

    ``P(n) = P(n - 1) - r [cos Theta(n), sin Theta(n)]``, [PT] 2.6.4 with the base added once.
    """
    step = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)
    points = np.zeros((*step.shape[:-2], step.shape[-2] + 1, 2))
    points[..., 1:, :] = -np.cumsum(step, axis=-2) * (length / angles_rad.shape[-1])
    return points
