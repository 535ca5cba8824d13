"""Undulation: lateral swing of each part of the body, and its advance along the path."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.track.frame_runs import consecutive
from snakewalk.controller.track.resample import body_points
from snakewalk.controller.track.track import Track, even_bodies


@dataclass(frozen=True, slots=True)
class Undulation:
    """Amplitudes along the body, relative to its slow path."""

    angle_rad: Floats
    """(N,) amplitude of the tangent angle: root of twice its variance over time."""
    lateral: Floats
    """(N + 1,) amplitude across the path, body lengths."""


def even_points(track: Track) -> Floats | None:
    """Points (T, 101, 2) at equal arc lengths, body lengths; None if places are not recorded.

    Files of joint angles put every head at the origin; images cropped to the animal share no
    origin.
    """
    if not track.places_recorded:
        return None
    heads = track.points[:, 0]
    if np.ptp(heads, axis=0).max() <= 1e-9:
        return None
    even, length = even_bodies(track.points)
    return even / length


def measure_undulation(track: Track, frequency_hz: float) -> Undulation:
    """Amplitudes along the body.

    The mean heading, smoothed over a cycle of ``frequency_hz``, is the path's direction: slow turns
    do not count as swings.
    """
    heading = track.angles_rad.mean(axis=1)
    cycle = track.rate_hz / max(frequency_hz, 1e-9)
    number = np.rint(track.time_s * track.rate_hz).astype(np.int64)
    slow = _smoothed_over_cycle(number, heading, cycle)
    swing = track.angles_rad - slow[:, None]
    body = even_points(track)
    if body is None:
        body = body_points(track.angles_rad)
        body = body - body.mean(axis=1, keepdims=True)
    centre = np.stack(
        [_smoothed_over_cycle(number, column, cycle) for column in body.mean(axis=1).T], axis=-1
    )
    across = np.stack([-np.sin(slow), np.cos(slow)], axis=-1)
    side = ((body - centre[:, None]) * across[:, None]).sum(axis=-1)
    return Undulation(np.sqrt(2.0) * swing.std(axis=0), np.sqrt(2.0) * side.std(axis=0))


@dataclass(frozen=True, slots=True)
class Advance:
    """Speed of each segment, points of N per frame; for the pairs of ``measure_pulse_speed``."""

    along: Floats
    """(S, N) along the body's own tangent there, forwards positive."""
    headward: Floats
    """(S, N) in the direction of the head."""
    cosine: Floats
    """(S, N) of the angle between the tangent there and the head's."""

    def head_speed(self, pulse: Floats) -> Floats:
        """Speed of the head along its tangent (S, N), from each segment and its ``pulse`` (S, N).

        With the skeleton of [PT] 2.6.4 a segment moves at the pulse speed along its own tangent.
        All segments also move in the head's direction, at the difference of head speed and pulse
        speed.
        """
        return self.headward + pulse * (1.0 - self.cosine)


def advance_of(body: Floats, number: Ints, step: int) -> Advance:
    """Speed of each segment between frames that are ``step`` apart.

    ``body`` are points (T, N + 1, 2) in body lengths, at equal arcs; ``number`` (T,) frame numbers.
    """
    segments = body.shape[1] - 1
    index = np.searchsorted(number, number - step)
    later = np.flatnonzero(number[index] == number - step)
    earlier = index[later]
    middle = 0.5 * (body[:, 1:] + body[:, :-1])
    forward = body[:, :-1] - body[:, 1:]
    mean = forward[later] + forward[earlier]
    mean = mean / np.maximum(np.hypot(mean[..., 0], mean[..., 1]), 1e-12)[..., None]
    gone = (middle[later] - middle[earlier]) * (segments / step)
    head = mean[:, :1]
    return Advance(
        (gone * mean).sum(axis=-1),
        (gone * head).sum(axis=-1),
        (mean * head).sum(axis=-1),
    )


def _smoothed_over_cycle(number: Ints, values: Floats, cycle: float) -> Floats:
    """Smooth a series over a cycle of this many frames.

    Parts between gaps are smoothed separately; those shorter than a cycle follow one line through
    all frames.
    """
    runs = consecutive(number)
    if len(runs) == 1:
        return _slow_run(values, cycle)
    line = np.polynomial.Polynomial.fit(number, values, 1)(number)
    slow = np.asarray(line, dtype=float)
    for run in runs:
        if len(run) >= max(cycle, 2.0):
            slow[run] = _slow_run(values[run], cycle)
    return slow


def _slow_run(values: Floats, cycle: float) -> Floats:
    """Smooth a series of consecutive frames over a cycle."""
    trend = np.polynomial.Polynomial.fit(np.arange(len(values)), values, 1)
    line = trend(np.arange(len(values)))
    if len(values) < 3.0 * cycle:
        return np.asarray(line)
    return np.asarray(line + gaussian_filter1d(values - line, cycle / 2.0, mode="nearest"))
