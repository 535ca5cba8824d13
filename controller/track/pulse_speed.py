"""Pulse speed: points that the pattern of angles moves towards the tail per frame ([PT] 2.4).

The place ``n - (u - w)`` has a whole u and 0 <= w < 1, both from least squares over nine points.
The interpolation is ``Theta(n, t) = Theta(n - u, t - 1) + w (Theta(n + 1 - u, t - 1) - Theta(n - u,
t - 1))``.
Correction: the pulse speed is ``U = u - w``; the text prints ``u + w``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from snakewalk.config.arrays import Bools, Floats, Ints

NEIGHBOURS = 9
"""Points that decide together, [PT] 2.4."""
LEAST_SLOPE = 0.2
"""Share of the recording's usual slope along the body: a flatter neighbourhood shows no shift."""
_EDGE = 1e-9
_SLACK = 0.5  # points that the pulse may differ between neighbours


@dataclass(frozen=True, slots=True)
class PulseSpeed:
    """U(n, t) of a recording."""

    points_per_frame: Floats
    """(S, N) positive towards the tail; NaN where the neighbourhood is too flat, or where the
    pattern would have come from beyond the body's end."""
    slope: Floats
    """(S, N) root mean square of Theta_n over the neighbourhood, rad a point: the weight."""
    error_rad: Floats
    """(S, N) root mean square of the residual of the shifted angles."""
    frame: Ints
    """(S,) index of the later frame of each pair."""
    step: int
    """Frames from the earlier to the later of a pair; speeds are divided by it."""
    body_points_per_frame: Floats
    """(S,) one speed for the whole body: the mean of U, weighted by slope squared; or NaN."""
    body_error_rad: Floats
    """(S, N) signed error of that model, ``Theta(n - U(t)) - Theta(n)``, [PT] Fig. 5(a); NaN where
    the pattern came from beyond the body."""

    @property
    def typical(self) -> float:
        """Median of U, points per frame; NaN if nothing was measured."""
        is_known = np.isfinite(self.points_per_frame)
        return float(np.median(self.points_per_frame[is_known])) if is_known.any() else float("nan")


def measure_pulse_speed(
    angles_rad: Floats,
    number: Ints,
    step: int = 1,
    most: int = 12,
    *,
    heading_known: bool = True,
) -> PulseSpeed:
    """Measure U(n, t).

    A slow pulse needs a larger ``step``: a shift of a few points has an error of a few hundredths.
    ``most`` must stay below half a wavelength; a larger shift matches the next wave.

    Args:
        angles_rad: (T, N) tangent angles, head first, unwrapped along the body.
        number: (T,) frame numbers, increasing.
        step: frames between those compared.
        most: largest shift tried in either direction, points.
        heading_known: False if each frame has its own heading (recordings of joint angles): one
            rotation of the whole body per frame is then fitted first.

    Raises:
        ValueError: ``step`` or ``most`` below 1, or too few points for such a shift.

    """
    points = angles_rad.shape[1]
    if step < 1 or most < 1 or points < NEIGHBOURS + 2 * most:
        raise ValueError(f"cannot look for shifts of {most} points over {step} frames on {points}")
    later, earlier = _pairs(number, step)
    now = angles_rad[later]
    before = angles_rad[earlier]
    if not heading_known:
        before = before + _body_rotation(now, before)[:, None]
    best = np.full(now.shape, np.inf)
    shift = np.full(now.shape, np.nan)
    for u in range(1 - most, most + 1):
        w, error = _fit(now, before, u)
        better = error < best
        best = np.where(better, error, best)
        shift = np.where(better, u - w, shift)
    slope = np.sqrt(_sums(np.diff(before, axis=1) ** 2) / NEIGHBOURS)
    slope = np.pad(slope, ((0, 0), (4, 5)), mode="edge")
    usual = np.sqrt((np.diff(before, axis=1) ** 2).mean()) if before.size else 0.0
    # a best shift at the end of the range is not a minimum: the pattern came from beyond the body,
    # or moved farther than was tried
    n = np.arange(points)
    ahead, behind = n - NEIGHBOURS // 2 - 1 - shift, points - 2 - NEIGHBOURS // 2 - n + shift
    inside = (ahead > _EDGE) & (behind > _EDGE) & (np.abs(shift) < most - 0.5)
    is_known = inside & (slope > LEAST_SLOPE * usual) & np.isfinite(best)
    _forget_beyond(is_known, shift, most)
    body_shift = _whole_body(shift, np.where(is_known, slope**2, 0.0))
    return PulseSpeed(
        points_per_frame=np.where(is_known, shift, np.nan) / step,
        slope=slope,
        error_rad=np.sqrt(np.where(is_known, best, np.nan) / NEIGHBOURS),
        frame=later,
        step=step,
        body_points_per_frame=body_shift / step,
        body_error_rad=_estimate(before, body_shift) - now,
    )


def _whole_body(shift: Floats, weight: Floats) -> Floats:
    """Weighted mean (S,) of shifts (S, N); NaN if all weights are 0."""
    total = weight.sum(axis=1)
    moved = (weight * np.where(weight > 0.0, shift, 0.0)).sum(axis=1)
    return np.where(total > 0.0, moved / np.where(total > 0.0, total, 1.0), np.nan)


def _estimate(before: Floats, shift: Floats) -> Floats:
    """``Theta_e(n) = Theta(n - U)``, (S, N), linear between points; NaN beyond the body."""
    last = before.shape[1] - 1
    place = np.arange(last + 1) - shift[:, None]
    is_inside = (place >= 0.0) & (place <= last)
    safe = np.where(is_inside, place, 0.0)
    low = np.minimum(safe.astype(np.int64), last - 1)
    start, end = (np.take_along_axis(before, low + k, axis=1) for k in (0, 1))
    return np.where(is_inside, start + (safe - low) * (end - start), np.nan)


def _forget_beyond(is_known: Bools, shift: Floats, most: int) -> None:
    """Clear chance fits next to neighbours whose shift comes from beyond the head or the tail.

    There the true shift is out of reach, and another shift may be a minimum. The neighbours are the
    known ones among ``most + NEIGHBOURS`` points towards the middle.
    """
    for is_known_side, far in (
        (is_known, shift),
        (is_known[:, ::-1], -shift[:, ::-1]),
    ):  # from the tail: mirrored
        for n in range(min(most + NEIGHBOURS, is_known_side.shape[1] // 2), -1, -1):
            window = slice(n + 1, n + 1 + most + NEIGHBOURS)
            near = is_known_side[:, window]
            order = np.sort(np.where(near, far[:, window], np.inf), axis=1)
            middle = np.maximum(near.sum(axis=1) - 1, 0) // 2  # the lower median
            usual = np.where(near.any(axis=1), order[np.arange(len(order)), middle], 0.0)
            is_known_side[:, n] &= n - NEIGHBOURS // 2 - 1 - usual > -_SLACK


def _pairs(number: Ints, step: int) -> tuple[Ints, Ints]:
    """Indices of later and earlier frames that are ``step`` apart."""
    index = np.searchsorted(number, number - step)
    later = np.flatnonzero(number[index] == number - step)
    return later, index[later]


def _fit(now: Floats, before: Floats, u: int) -> tuple[Floats, Floats]:
    """Best w in 0..1 and squared residual, (S, N), for the whole shift u; inf where unseen."""
    points = now.shape[1]
    w = np.full(now.shape, np.nan)
    error = np.full(now.shape, np.inf)
    first, last = max(0, u), min(points, points - 1 + u)  # n with n - u and n + 1 - u on the body
    if last - first < NEIGHBOURS:
        return w, error
    start = before[:, first - u : last - u]
    rise = before[:, first - u + 1 : last - u + 1] - start
    off = now[:, first:last] - start
    square = _sums(rise**2)
    cross = _sums(rise * off)
    share = np.clip(cross / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    middle = slice(first + NEIGHBOURS // 2, last - NEIGHBOURS // 2)
    w[:, middle] = share
    left = _sums(off**2) - 2.0 * share * cross + share**2 * square
    error[:, middle] = np.maximum(left, 0.0)
    return w, error


def _sums(values: Floats) -> Floats:
    """Sums over nine neighbours: (S, M) to (S, M - 8)."""
    return np.asarray(sliding_window_view(values, NEIGHBOURS, axis=1).sum(axis=-1))


def _body_rotation(now: Floats, before: Floats) -> Floats:
    """Rotation of the whole body (S,) that, with one common shift, fits a frame best."""
    slope = np.gradient(before, axis=1)
    change = now - before
    flat = slope - slope.mean(axis=1, keepdims=True)
    spread = (flat**2).sum(axis=1)
    pulse = (flat * change).sum(axis=1) / np.where(spread > 0.0, spread, 1.0)
    return np.asarray((change - pulse[:, None] * slope).mean(axis=1))
