"""Recordings as named arrays: .npz and MATLAB files of bodies, .npy files of joint angles."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.archive import DAMAGE, read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.console.separate_reader import read_separately
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers import mat_file
from snakewalk.controller.track.resample import body_points
from snakewalk.controller.track.track import Track, track_from_points

SKELETON_RATE_HZ = 30.0
JOINT_RATE_HZ = 32.0
"""Defaults: neither kind of file holds a frame rate."""
_BODIES = ("points", "angles_rad", "x", "y", "skeletons")
ARRAYS = {*_BODIES, "t", "rate_hz", "length_m", "score", "name", "source", "licence"} | {
    "rate_assumed",
    "verdict",
    "time_s",
    "notes",
    "places_recorded",
    "head_sure",
}
"""The arrays that are read of an .npz; others, such as the widths of a body, stay in the file."""


def save_track(path: Path, track: Track) -> None:
    """Write our format: points (dropped frames as NaN), rate_hz, length_m (NaN: no scale)."""
    number = np.rint(track.time_s * track.rate_hz).astype(int)
    points = np.full((number[-1] + 1, *track.points.shape[1:]), np.nan)
    points[number] = track.points
    verdict = [FrameStatus.MISSING] * len(points)
    for k, status in zip(number, track.status or [FrameStatus.GOOD] * len(number), strict=True):
        verdict[k] = status
    more: dict[str, Any] = {"notes": np.array(track.notes)} if track.notes else {}
    np.savez_compressed(
        path,
        points=points,
        rate_hz=track.rate_hz,
        length_m=np.nan if track.length_m is None else track.length_m,
        name=track.name,
        source=track.source,
        licence=track.licence,
        rate_assumed=track.rate_assumed,
        verdict=np.array([str(frame_verdict) for frame_verdict in verdict]),
        **more,
        places_recorded=track.places_recorded,
        head_sure=np.nan if track.head_sure is None else track.head_sure,
    )


def load_npz(file: Path, choice: Choice) -> Track:
    """Load an .npz with ``track_from_arrays``; see ``load.load_file``."""
    try:
        arrays, others = read_arrays(file, ARRAYS)
    except (ValueError, OSError) as error:
        raise InputError(f"{file}: is not an .npz of plain arrays: {error}") from None
    return track_from_arrays(file, arrays, choice, others)


def load_mat(file: Path, choice: Choice) -> Track:
    """Load a MATLAB file up to version 7 with ``track_from_arrays``; 7.3 is HDF5."""
    arrays, _ = read_separately(file, mat_file.__name__)
    return track_from_arrays(file, arrays, choice)


def track_from_arrays(
    file: Path,
    arrays: dict[str, NDArray[np.generic]],
    choice: Choice,
    others: Sequence[str] = (),
) -> Track:
    """Make a track from named arrays of an .npz or .mat.

    ``points`` are (T, P, 2) head first, or ``x`` and ``y`` (T, P); in metres if ``length_m`` is a
    number. ``angles_rad`` are the (T, P) directions of equal segments; ``length_m`` is then the
    body's length. ``rate_hz``, or ``time_s`` or ``t`` in seconds, state the times. ``score`` (T, P)
    is the tracker's confidence. ``skeletons`` are pixels, rows downwards.
    """
    time_s = None if choice.rate is not None else _times(file, arrays)
    given = choice.rate
    if given is None and "rate_hz" in arrays:
        given = _scalar(file, "rate_hz", arrays["rate_hz"])
    if given is None and time_s is not None:
        given = float(1.0 / np.median(np.diff(time_s)))
    bodies = arrays.keys() & {"points", "angles_rad"} or {"x", "y"} <= arrays.keys()
    if bodies and given is not None:
        length_m = _scalar(file, "length_m", arrays.get("length_m", np.array(np.nan)))
        points = _bodies(file, arrays, length_m if np.isfinite(length_m) else 1.0)
        track = track_from_points(
            _text(arrays, "name", file.stem),
            _without_unsure(file, points, arrays, choice.min_score),
            given,
            scale_m=1.0 if np.isfinite(length_m) else None,
            time_s=time_s if time_s is not None and len(time_s) == len(points) else None,
            rate_assumed=choice.rate is None and _flag(arrays, "rate_assumed", default=False),
            status=_status(arrays, len(points)),
        )
        sure = _scalar(file, "head_sure", arrays.get("head_sure", np.array(np.nan)))
        return replace(
            track,
            source=_text(arrays, "source", "not stated"),
            licence=_text(arrays, "licence", "not stated"),
            notes=tuple(str(line) for line in arrays.get("notes", np.array([])).reshape(-1)),
            places_recorded=_flag(arrays, "places_recorded", default=True),
            head_sure=sure if np.isfinite(sure) else None,
        )
    if "skeletons" in arrays:
        points = _floats(file, "skeletons", arrays["skeletons"])
        if points.ndim == 3:
            points = points * [1.0, -1.0]
        points = _without_unsure(file, points, arrays, choice.min_score)
        rate = SKELETON_RATE_HZ if given is None else given
        return track_from_points(file.stem, points, rate, rate_assumed=given is None)
    names = ", ".join(sorted([*arrays, *others])[:12]) or "none"
    raise InputError(
        f"{file}: expected the arrays points or angles_rad (or x and y), and rate_hz or t (and "
        f"length_m); or skeletons; found {names}"
    )


def _flag(arrays: dict[str, NDArray[np.generic]], name: str, *, default: bool) -> bool:
    if name not in arrays or not arrays[name].size:
        return default
    return bool(arrays[name].reshape(-1)[:1].astype(bool).all())


def _status(arrays: dict[str, NDArray[np.generic]], frames: int) -> list[FrameStatus]:
    """The frames' verdicts, if all are of ``FrameStatus``."""
    words = [str(word) for word in arrays.get("verdict", np.array([])).reshape(-1)]
    verdicts = {str(frame_status) for frame_status in FrameStatus}
    return list(map(FrameStatus, words)) if len(words) == frames and verdicts >= set(words) else []


def _times(file: Path, arrays: dict[str, NDArray[np.generic]]) -> Floats | None:
    """Times of the frames, s; None if the file has none."""
    key = next((name for name in ("time_s", "t") if name in arrays), None)
    if key is None:
        return None
    time_s = _floats(file, key, arrays[key]).ravel()
    step = np.diff(time_s)
    if len(step) == 0 or not (step > 0.0).all():
        raise InputError(f"{file}: {key} must increase from frame to frame, in seconds")
    return time_s


def _bodies(file: Path, arrays: dict[str, NDArray[np.generic]], length: float) -> Floats:
    """Points (T, P, 2) from ``points``, ``angles_rad``, or ``x`` and ``y``."""
    if "points" in arrays:
        return _floats(file, "points", arrays["points"])
    if "angles_rad" in arrays:
        angles = _floats(file, "angles_rad", arrays["angles_rad"])
        if angles.ndim != 2 or angles.shape[1] < 4:
            raise InputError(
                f"{file}: angles_rad must be (frames, 4 or more), {_not_shape(angles)}"
            )
        return body_points(angles, length)
    x, y = _floats(file, "x", arrays["x"]), _floats(file, "y", arrays["y"])
    if x.shape != y.shape or x.ndim != 2:
        raise InputError(f"{file}: x and y must both be (frames, points), not {x.shape}, {y.shape}")
    return np.stack([x, y], axis=-1)


def _without_unsure(
    file: Path, points: Floats, arrays: dict[str, NDArray[np.generic]], least_score: float | None
) -> Floats:
    """Points; NaN where the tracker's score is below the least one."""
    if not least_score:
        return points
    if "score" not in arrays:
        raise InputError(f"{file}: holds no scores to compare with a least score of {least_score}")
    score = _floats(file, "score", arrays["score"])
    if score.shape != points.shape[:2]:
        raise InputError(f"{file}: score must be (frames, points), {_not_shape(score)}")
    return np.where((score < least_score)[..., None], np.nan, points)


def load_npy(file: Path, choice: Choice) -> Track:
    """Load joint angles (T, J), rad, column 0 next to the head; see ``load.load_file``.

    Positive angles bend the head side to the left. The file has no places: in every frame the head
    is at the origin and the mean heading is x.
    """
    try:
        values = np.load(file, mmap_mode="r", allow_pickle=False)  # maps no more than the file has
    except (OSError, *DAMAGE) as error:
        raise InputError(f"{file}: is not an .npy of plain numbers: {error}") from None
    joints = _floats(file, "joint angles", np.asarray(values))
    if joints.ndim != 2 or joints.shape[1] < 3:
        raise InputError(
            f"{file}: expected joint angles (frames, 3 or more joints), {_not_shape(joints)}"
        )
    link_rad = np.concatenate([np.zeros((len(joints), 1)), -np.cumsum(joints, axis=1)], axis=1)
    points = body_points(link_rad - link_rad.mean(axis=1, keepdims=True))
    rate = choice.rate or JOINT_RATE_HZ
    return track_from_points(file.stem, points, rate, rate_assumed=choice.rate is None)


def _floats(file: Path, what: str, values: NDArray[np.generic]) -> Floats:
    if values.dtype.kind not in "fiu":
        raise InputError(f"{file}: {what}: expected numbers, not {values.dtype}")
    return np.asarray(values, dtype=float)


def _scalar(file: Path, what: str, value: NDArray[np.generic]) -> float:
    number = _floats(file, what, value)
    if number.size != 1:
        raise InputError(f"{file}: {what}: expected one number, {_not_shape(number)}")
    return float(number.reshape(()))


def _text(arrays: dict[str, NDArray[np.generic]], name: str, default: str) -> str:
    if name not in arrays or arrays[name].size != 1:
        return default
    return str(arrays[name].reshape(-1)[0])


def _not_shape(values: Floats) -> str:
    return f"not an array of shape {values.shape}"
