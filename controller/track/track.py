"""A recording of a moving body: midlines over time, and the tangent angles of 100 segments."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy  # scipy.interpolate loads when it is first used

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.reading import Facts
from snakewalk.controller.track.frame_runs import (
    common_step,
    is_mostly_every_nth,
    missing_frames,
)
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.resample import equal_arc_length, tangent_angles

MOST_FRAMES = 500_000
"""Frames of a track, gaps included (ours): 4.6 hours at 30 Hz."""
_UNEVEN = 0.1  # of a frame: largest deviation of times from an even rate
_LONGEST_STEP = 2.5  # frames: bodies are not interpolated over larger gaps


@dataclass(frozen=True, slots=True)
class Track:
    """A recording of any kind; frames without a whole midline are dropped and counted."""

    name: str
    angles_rad: Floats
    """(T, 100) direction of travel, head first, unwrapped along the body and over time."""
    points: Floats
    """(T, P, 2) midline, head first; m, or body lengths where ``length_m`` is None."""
    time_s: Floats
    """(T,) of the kept frames, increasing; a gap where frames were dropped."""
    rate_hz: float
    """Frames a second of the camera; of uneven times, the rate at which bodies are put between."""
    length_m: float | None
    """Body length; None where the recording has no scale."""
    dropped: int
    """Frames that were left out because points were missing."""
    absent: int = 0
    """Frames between the first and the last for which the file has no row."""
    every: int = 1
    """Frames of the camera from one row of the file to the next; ``rate_hz`` counts rows."""
    notes: tuple[str, ...] = ()
    """Lines about parts that the reader left out or changed."""
    rate_assumed: bool = False
    """Whether the file states no rate, so that the default of its format was taken."""
    uneven: bool = False
    """Whether the frames came at uneven times, so that bodies were put between them."""
    status: tuple[FrameStatus, ...] = ()
    """(T,) of the kept frames; empty where the file says nothing of them."""
    source: str = "not stated"
    licence: str = "not stated"
    places_recorded: bool = True
    """Whether the points of different frames share one origin; not of images cropped to the animal,
    nor of a camera that moves: they contain no travel."""
    facts: Facts = field(default_factory=dict)
    """Quantity, unit, order and time base of a file's values."""
    head_sure: float | None = None
    """Certainty that the first point is the head, 0 to 1; None where the file does not say."""

    @property
    def frames(self) -> int:
        """Number of kept frames T."""
        return len(self.angles_rad)

    @property
    def bridged(self) -> int:
        """Number of frames with an interpolated keypoint."""
        return self.status.count(FrameStatus.BRIDGED)

    @property
    def bend_rad(self) -> Floats:
        """K of every frame, (T,): standard deviation of the tangent angles ([PT] 2.6.3)."""
        return np.asarray(self.angles_rad.std(axis=1))

    @property
    def flips(self) -> int:
        """Number of frames that fit their predecessor better with head and tail exchanged."""
        before, after = self.angles_rad[:-1], self.angles_rad[1:]
        same_order = 1.0 - np.cos(after - before).mean(axis=1)
        flipped = 1.0 - np.cos(after[:, ::-1] + np.pi - before).mean(axis=1)
        joined = np.diff(self.time_s) < 1.5 / self.rate_hz
        return int(np.count_nonzero((flipped < same_order) & joined))


UNSURE_HEAD = 0.3
"""Value of ``head_sure`` below which head and tail may be exchanged."""


def track_from_points(
    name: str,
    points: Floats,
    rate_hz: float,
    *,
    scale_m: float | None = None,
    frame: Ints | None = None,
    time_s: Floats | None = None,
    rate_assumed: bool = False,
    status: Sequence[FrameStatus] = (),
) -> Track:
    """Build a ``Track`` from points (T, P, 2), head first, in any unit.

    Args:
        name: of the recording, for faults too.
        points: NaN where a point was not seen.
        rate_hz: frames per second.
        scale_m: metres per unit; None if unknown (points become body lengths).
        frame: (T,) frame numbers, increasing; default 0, 1, 2...
        time_s: (T,) times of the frames, increasing. If they are uneven, bodies are interpolated (a
            cubic spline per point) at the rate of the median step.
        rate_assumed: whether ``rate_hz`` is a guess.
        status: of every frame (T,), or empty.

    Raises:
        InputError: wrong shape, bad rate, or fewer than 2 whole frames.

    """
    if points.ndim != 3 or points.shape[-1] != 2 or points.shape[1] < 4:
        raise InputError(f"{name}: points must be (frames, 4 or more, 2), not {points.shape}")
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError(f"{name}: the frame rate must be above 0 Hz, not {rate_hz}")
    number = np.arange(len(points)) if frame is None else frame
    number, rate_hz, uneven = _frame_times(name, number, time_s, rate_hz)
    is_complete = np.asarray(np.isfinite(points).all(axis=(1, 2)))
    is_complete[is_complete] = [_distinct(body) for body in points[is_complete]]
    every = 1 if uneven else common_step(number[is_complete])
    if every > 1:
        listed = (number - number[is_complete][0]) % every == 0
        points = points[listed]
        is_complete = is_complete[listed]
        number = number[listed] // every
        status = [status[k] for k in np.flatnonzero(listed).tolist()] if status else ()
        rate_hz /= every
    elif not uneven and is_mostly_every_nth(number[is_complete]):
        time_s = number / rate_hz
        uneven = True
        rate_hz = 1.0 / float(np.median(np.diff(time_s[is_complete])))
    absent = _absent(number, time_s if uneven else None, rate_hz)
    dropped = int(len(points) - is_complete.sum())
    if time_s is not None and uneven:
        points, number, nearest = _bodies_at_even_rate(
            points, time_s - time_s[0], is_complete, rate_hz
        )
        status = [status[k] for k in nearest.tolist()] if status else ()
        is_complete = np.ones(len(points), dtype=bool)
    if is_complete.sum() < 2:
        raise InputError(
            f"{name}: only {int(is_complete.sum())} of {len(points)} frames hold a midline"
        )
    kept = points[is_complete]
    even, length = even_bodies(kept)
    return Track(
        name=name,
        angles_rad=_over_time(tangent_angles(even)),
        points=kept / length if scale_m is None else kept * scale_m,
        time_s=(number[is_complete] - number[0]) / rate_hz,
        rate_hz=float(rate_hz),
        length_m=None if scale_m is None else length * scale_m,
        dropped=dropped,
        absent=absent,
        every=every,
        rate_assumed=rate_assumed,
        uneven=uneven,
        status=tuple(status[k] for k in np.flatnonzero(is_complete).tolist()) if status else (),
    )


def even_bodies(bodies: Floats) -> tuple[Floats, float]:
    """Bodies (T, 101, 2) at equal arc lengths, and the median of their lengths."""
    even = np.stack([equal_arc_length(body) for body in bodies])
    return even, float(np.median(np.hypot(*np.diff(even, axis=1).transpose(2, 0, 1)).sum(axis=1)))


def _frame_times(
    name: str, number: Ints, time_s: Floats | None, rate_hz: float
) -> tuple[Ints, float, bool]:
    """Frame numbers, rate, and whether the times (T,) are uneven and determine both."""
    _check_span(name, number)
    if time_s is not None and _is_uneven(name, time_s, number):
        rate_hz = 1.0 / float(np.median(np.diff(time_s)))
        number = np.rint(np.clip((time_s - time_s[0]) * rate_hz, 0.0, 2.0**53)).astype(np.int64)
        _check_span(name, number)
        return number, rate_hz, True
    if np.any(number[1:] <= number[:-1]):
        raise InputError(f"{name}: frame numbers must increase, one row of points for each frame")
    return number, rate_hz, False


def _absent(number: Ints, time_s: Floats | None, rate_hz: float) -> int:
    """Number of frames between the first and the last row without a row."""
    if time_s is None:
        return missing_frames(number)
    return max(0, round(float(time_s[-1] - time_s[0]) * rate_hz) + 1 - len(time_s))


def _check_span(name: str, number: Ints) -> None:
    span = int(number[-1]) - int(number[0]) + 1 if len(number) else 0
    if span > MOST_FRAMES:
        raise InputError(
            f"{name}: its frames span {span}; a track has at most {MOST_FRAMES}: give a part of it"
        )


def _is_uneven(name: str, time_s: Floats, number: Ints) -> bool:
    """Whether times deviate from an even rate by more than ``_UNEVEN`` of a frame.

    Raises:
        InputError: times or frame numbers do not increase.

    """
    if np.any(np.diff(number) <= 0) or not (np.diff(time_s) > 0.0).all():
        raise InputError(f"{name}: frames and their times must increase, one body at a time")
    if len(time_s) < 3:
        return False
    step_s = float(time_s[-1] - time_s[0]) / float(number[-1] - number[0])
    off_s = time_s - time_s[0] - step_s * (number - number[0])
    return bool(np.abs(off_s).max() > _UNEVEN * step_s)


def _bodies_at_even_rate(
    points: Floats, time_s: Floats, is_complete: Bools, rate_hz: float
) -> tuple[Floats, Ints, Ints]:
    """Bodies (T', P, 2) at an even rate, their frame numbers, and the nearest frame of each.

    Times next to a frame without a body, or in long gaps, get no body.
    """
    first = np.flatnonzero(
        is_complete[:-1] & is_complete[1:] & (np.diff(time_s) <= _LONGEST_STEP / rate_hz)
    )
    bodies = [points[:0]]
    numbers = [np.zeros(0, np.int64)]
    nearest = [np.zeros(0, np.int64)]
    for run in np.split(first, np.flatnonzero(np.diff(first) > 1) + 1):
        if not run.size:
            continue
        frames = np.append(run, run[-1] + 1)
        at_s = time_s[frames]
        low, high = np.ceil(at_s[0] * rate_hz - 1e-9), np.floor(at_s[-1] * rate_hz + 1e-9)
        grid = np.arange(int(low), int(high) + 1)
        even_s = np.clip(grid / rate_hz, at_s[0], at_s[-1])
        bodies.append(
            scipy.interpolate.make_interp_spline(at_s, points[frames], k=min(3, len(frames) - 1))(
                even_s
            )
        )
        numbers.append(grid)
        middle = 0.5 * (at_s[1:] + at_s[:-1])
        nearest.append(frames[np.searchsorted(middle, even_s)])
    return np.concatenate(bodies), np.concatenate(numbers), np.concatenate(nearest)


def frame_numbers(name: str, values: Floats) -> Ints:
    """Frame numbers as integers.

    Raises:
        InputError: some are not whole, or too large.

    """
    is_part = ~((np.rint(values) == values) & (np.abs(values) < 2.0**53))
    if is_part.any():
        raise InputError(
            f"{name}: {int(is_part.sum())} of {len(values)} frame numbers are not whole numbers, "
            f"such as {values[is_part][0]:g}"
        )
    return values.astype(np.int64)


def _distinct(body: Floats) -> bool:
    chord = np.hypot(*np.diff(body, axis=0).T)
    return int(np.count_nonzero(chord > 1e-9 * chord.sum())) >= 3


def _over_time(angles_rad: Floats) -> Floats:
    """Shift whole frames by multiples of 2 pi, so that the mean heading never jumps."""
    mean = angles_rad.mean(axis=1)
    return np.asarray(angles_rad + (np.unwrap(mean) - mean)[:, None])
