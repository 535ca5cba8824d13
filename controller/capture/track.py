"""A recording of a moving body: midlines over time, and the tangent angles of 100 segments."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.frame_status import FrameStatus
from snakewalk.controller.capture.resample import equal_arc_length, tangent_angles

MOST_FRAMES = 500_000
"""Frames of a track, gaps included (ours): 4.6 hours at 30 Hz."""


@dataclass(frozen=True, slots=True)
class Track:
    """A recording of any kind; frames without a whole midline are left out and counted."""

    name: str
    angles_rad: Floats
    """(T, 100) direction of travel, head first, unwrapped along the body and over time."""
    points: Floats
    """(T, P, 2) midline, head first; m, or body lengths where ``length_m`` is None."""
    time_s: Floats
    """(T,) of the kept frames, increasing; a gap where frames were dropped."""
    rate_hz: float
    """Frames a second of the camera."""
    length_m: float | None
    """Body length; None where the recording has no scale."""
    dropped: int
    """Frames that were left out because points were missing."""
    rate_assumed: bool = False
    """Whether the file states no rate, so that the default of its format was taken."""
    status: tuple[FrameStatus, ...] = ()
    """(T,) of the kept frames; empty where the file says nothing of them."""
    source: str = "not stated"
    licence: str = "not stated"

    @property
    def frames(self) -> int:
        """Kept frames T."""
        return len(self.angles_rad)

    @property
    def bridged(self) -> int:
        """Frames in which a missing keypoint was set on the curve through the others."""
        return self.status.count(FrameStatus.BRIDGED)

    @property
    def bend_rad(self) -> Floats:
        """K of every frame, (T,): standard deviation of the tangent angles ([PT] 2.6.3)."""
        return np.asarray(self.angles_rad.std(axis=1))

    @property
    def flips(self) -> int:
        """Frames that fit the frame before better with head and tail exchanged: tracking faults."""
        before, after = self.angles_rad[:-1], self.angles_rad[1:]
        same = 1.0 - np.cos(after - before).mean(axis=1)
        flipped = 1.0 - np.cos(after[:, ::-1] + np.pi - before).mean(axis=1)
        joined = np.diff(self.time_s) < 1.5 / self.rate_hz
        return int(np.count_nonzero((flipped < same) & joined))


def track_from_points(
    name: str,
    points: Floats,
    rate_hz: float,
    *,
    scale_m: float | None = None,
    frame: Ints | None = None,
    rate_assumed: bool = False,
    status: Sequence[FrameStatus] = (),
    source: str = "not stated",
    licence: str = "not stated",
) -> Track:
    """Build a ``Track`` from points (T, P, 2), head first, in any unit.

    Args:
        name: of the recording, also used in faults.
        points: NaN where a point was not seen.
        rate_hz: frames a second.
        scale_m: metres per unit; None where it is unknown (points become body lengths).
        frame: (T,) frame numbers, increasing; default 0, 1, 2...
        rate_assumed: whether ``rate_hz`` is a guess.
        status: of every frame (T,), or nothing.
        source: origin of the recording.
        licence: under which it may be used.

    Raises:
        InputError: wrong shape, bad rate, or fewer than 2 whole frames.

    """
    if points.ndim != 3 or points.shape[-1] != 2 or points.shape[1] < 4:
        raise InputError(f"{name}: points must be (frames, 4 or more, 2), not {points.shape}")
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError(f"{name}: the frame rate must be above 0 Hz, not {rate_hz}")
    number = np.arange(len(points)) if frame is None else frame
    if np.any(number[1:] <= number[:-1]):
        raise InputError(f"{name}: frame numbers must increase, one row of points for each frame")
    span = int(number[-1]) - int(number[0]) + 1 if len(number) else 0
    if span > MOST_FRAMES:
        raise InputError(
            f"{name}: its frames span {span}; a track has at most {MOST_FRAMES}: give a part of it"
        )
    whole = np.asarray(np.isfinite(points).all(axis=(1, 2)))
    whole[whole] = [_distinct(body) for body in points[whole]]
    if int(whole.sum()) < 2:
        raise InputError(f"{name}: only {int(whole.sum())} of {len(points)} frames hold a midline")
    kept = points[whole]
    even = np.stack([equal_arc_length(body) for body in kept])
    length = float(np.median(np.hypot(*np.diff(even, axis=1).transpose(2, 0, 1)).sum(axis=1)))
    return Track(
        name=name,
        angles_rad=_over_time(tangent_angles(even)),
        points=kept / length if scale_m is None else kept * scale_m,
        time_s=(number[whole] - number[0]) / rate_hz,
        rate_hz=float(rate_hz),
        length_m=None if scale_m is None else length * scale_m,
        dropped=int(len(points) - whole.sum()),
        rate_assumed=rate_assumed,
        status=tuple(status[k] for k in np.flatnonzero(whole).tolist()) if status else (),
        source=source,
        licence=licence,
    )


def frame_numbers(name: str, values: Floats) -> Ints:
    """Frame numbers as integers.

    Raises:
        InputError: some are not whole, or too large to count frames.

    """
    odd = ~((np.rint(values) == values) & (np.abs(values) < 2.0**53))
    if odd.any():
        raise InputError(
            f"{name}: {int(odd.sum())} of {len(values)} frame numbers are no whole numbers, such "
            f"as {values[odd][0]:g}"
        )
    return values.astype(np.int64)


def _distinct(body: Floats) -> bool:
    chord = np.hypot(*np.diff(body, axis=0).T)
    return int(np.count_nonzero(chord > 1e-9 * chord.sum())) >= 3


def _over_time(angles_rad: Floats) -> Floats:
    """Shift whole frames by turns of 2 pi, so that the mean heading never jumps."""
    mean = angles_rad.mean(axis=1)
    return np.asarray(angles_rad + (np.unwrap(mean) - mean)[:, None])
