"""A motion cut where the body passes through a basic posture, [TH] 4.1.

Corrections: the printed merge compares the first and last direction only, so that a left turn and a
right turn become "forward"; each part must be below the threshold too. Directions are compared
wrapped. A missing frame ends a segment. The basic posture may be other than straight: an eel is
never straight while it swims, but passes through one posture again and again.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.postures import Postures

Kind = Literal["glide", "forward", "left", "right"]
WITHIN_RAD = float(np.radians(4.0))
"""[TH] 4.1.1: how near every spine angle must be to the basic posture's."""


@dataclass(frozen=True, slots=True)
class Segmentation:
    """How a motion is cut."""

    within_rad: float = WITHIN_RAD
    merge_rad: float = float(np.radians(20.0))
    """T_h: beats that turn less than this, one by one and together, are one segment."""
    glide_s: float = 0.12
    """A basic posture kept this long is a glide of its own."""


@dataclass(frozen=True, slots=True)
class MotionSegment:
    """Frames ``start`` to ``stop``, both in the basic posture and both part of it."""

    kind: Kind
    start: int
    stop: int
    turn_rad: float
    """Change of the head's direction, positive to the left."""
    begin_speed: float
    end_speed: float
    """Speed of the base of the head, in the recording's unit a second."""
    parts: int = 1
    """Beats that were merged."""


def basic_frames(angles_rad: Floats, reference_rad: Floats, within_rad: float) -> Bools:
    """(T,) whether all spine angles (T, J) are within ``within_rad`` of the reference (J,)."""
    difference_rad = np.abs(angles_rad - reference_rad).max(axis=1)
    return np.asarray(np.isfinite(difference_rad) & (difference_rad <= within_rad))


def commonest_posture(angles_rad: Floats, within_rad: float) -> Floats:
    """(J,) the frame's posture that the motion comes back to most often."""
    finite_angles = angles_rad[np.isfinite(angles_rad).all(axis=1)]
    best = finite_angles[0]
    most = -1
    for posture in finite_angles[:: max(1, len(finite_angles) // 400)]:
        is_basic = basic_frames(angles_rad, posture, within_rad)
        visits = int(np.count_nonzero(is_basic[1:] & ~is_basic[:-1])) + int(is_basic[0])
        if visits > most:
            best = posture
            most = visits
    return np.asarray(best)


def segment_motion(
    postures: Postures, cutting: Segmentation | None = None, reference_rad: Floats | None = None
) -> list[MotionSegment]:
    """Cut a motion into glides and merged beats; the frames before and after are left out.

    Args:
        postures: of a film.
        cutting: thresholds.
        reference_rad: (J,) the basic posture; straight by default.

    Raises:
        InputError: the basic posture is not passed twice.

    """
    how = cutting or Segmentation()
    straight = np.zeros(postures.angles_rad.shape[1])
    reference = straight if reference_rad is None else reference_rad
    basic = basic_frames(postures.angles_rad, reference, how.within_rad)
    edge = np.flatnonzero(np.diff(np.concatenate([[False], basic, [False]]).astype(int)))
    runs = list(zip(edge[::2].tolist(), (edge[1::2] - 1).tolist(), strict=True))
    speed = speeds(postures)
    segments: list[MotionSegment] = []
    left_at: int | None = None
    for first, last in runs:
        long = (last - first) >= max(1, round(how.glide_s * postures.rate_hz))
        enter, leave = (first, last) if long else ((first + last) // 2,) * 2
        if left_at is not None and bool(postures.found[left_at : enter + 1].all()):
            segments.append(_segment(postures, speed, left_at, enter, how, beat=True))
        if long:
            segments.append(_segment(postures, speed, first, last, how, beat=False))
        left_at = leave
    if not segments:
        closest = float(np.nanmin(np.abs(postures.angles_rad - reference).max(axis=1)))
        raise InputError(
            f"{postures.name}: the basic posture occurs {len(runs)} times, which "
            f"gives no segment; the closest frame differs by {np.degrees(closest):.1f} degrees, "
            f"the limit is {np.degrees(how.within_rad):.1f}; raise --within, or use "
            "--reference commonest"
        )
    return merge(segments, how.merge_rad)


def merge(segments: list[MotionSegment], merge_rad: float) -> list[MotionSegment]:
    """Join beats that follow each other and turn little, one by one *and* together ([TH] 4.1.3)."""
    out: list[MotionSegment] = []
    for segment in segments:
        last = out[-1] if out else None
        if (
            last is not None
            and last.kind == segment.kind == "forward"
            and last.stop == segment.start
            and abs(last.turn_rad + segment.turn_rad) < merge_rad
        ):
            out[-1] = replace(
                last,
                stop=segment.stop,
                turn_rad=last.turn_rad + segment.turn_rad,
                end_speed=segment.end_speed,
                parts=last.parts + segment.parts,
            )
        else:
            out.append(segment)
    return out


def speeds(postures: Postures) -> Floats:
    """(T,) speed of the base of the head, by a straight line through a sixth of a second.

    The speed is in space if a side view gives the height of the base.
    """
    half = max(1, round(postures.rate_hz / 12.0))
    base = postures.base
    if postures.height is not None:
        base = np.column_stack([base, postures.height])
    out = np.full(postures.frames, np.nan)
    for k in range(postures.frames):
        window = np.arange(max(0, k - half), min(postures.frames, k + half + 1))
        window = window[np.isfinite(base[window]).all(axis=1)]
        if len(window) > 1:
            time = (window - window.mean()) / postures.rate_hz
            out[k] = float(np.linalg.norm(time @ base[window] / (time @ time)))
    return out


def turned(head_rad: Floats) -> float:
    """How far directions (n,) turn from first to last, each step wrapped."""
    step = np.diff(head_rad)
    return float(np.angle(np.exp(1j * step)).sum())


def _segment(
    postures: Postures, speed: Floats, start: int, stop: int, how: Segmentation, *, beat: bool
) -> MotionSegment:
    turn = turned(postures.head_rad[start : stop + 1])
    kind: Kind = "glide"
    if beat:
        kind = "forward" if abs(turn) < how.merge_rad else ("left" if turn > 0.0 else "right")
    return MotionSegment(kind, start, stop, turn, float(speed[start]), float(speed[stop]))
