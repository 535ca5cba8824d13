"""Recordings as numpy files: our own tracks, skeletons found in images, and joint angles."""

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError
from controller.capture.resample import body_points
from controller.capture.track import Track, track_from_points

Floats = NDArray[np.float64]
SKELETON_RATE_HZ = 30.0
JOINT_RATE_HZ = 32.0
"""Taken when nobody says otherwise: neither kind of file holds a frame rate."""


def save_track(path: Path, track: Track) -> None:
    """Write our own format: points (dropped frames as NaN), rate_hz, length_m (NaN: no scale)."""
    number = np.rint(track.time_s * track.rate_hz).astype(int)
    points = np.full((number[-1] + 1, *track.points.shape[1:]), np.nan)
    points[number] = track.points
    np.savez_compressed(
        path,
        points=points,
        rate_hz=track.rate_hz,
        length_m=np.nan if track.length_m is None else track.length_m,
        name=track.name,
        source=track.source,
        licence=track.licence,
    )


def load_npz(file: Path, rate_hz: float | None) -> Track:
    """Load ``points`` or ``angles_rad`` with ``rate_hz``, or ``skeletons``: ``formats.load_file``.

    ``points`` are (T, P, 2) head first, in metres where ``length_m`` is a number; ``angles_rad``
    are the (T, P) directions of equally long pieces, and ``length_m`` is then the body's length.
    ``skeletons`` are pixels, rows downwards.
    """
    try:
        with np.load(file, allow_pickle=False) as data:
            held = {name: np.asarray(data[name]) for name in data.files if name != "width"}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{file}: is not an .npz of plain arrays: {error}") from None
    if held.keys() & {"points", "angles_rad"} and "rate_hz" in held:
        length_m = _scalar(file, "length_m", held.get("length_m", np.array(np.nan)))
        said = _scalar(file, "rate_hz", held["rate_hz"])
        if "points" in held:
            points = _floats(file, "points", held["points"])
        else:
            angles = _floats(file, "angles_rad", held["angles_rad"])
            if angles.ndim != 2 or angles.shape[1] < 4:
                raise InputError(f"{file}: angles_rad must be (frames, 4 or more), {_is(angles)}")
            points = body_points(angles, length_m if np.isfinite(length_m) else 1.0)
        return track_from_points(
            str(held.get("name", file.stem)),
            points,
            said if rate_hz is None else rate_hz,
            scale_m=1.0 if np.isfinite(length_m) else None,
            source=str(held.get("source", "not stated")),
            licence=str(held.get("licence", "not stated")),
        )
    if "skeletons" in held:
        points = _floats(file, "skeletons", held["skeletons"])
        if points.ndim == 3:
            points = points * [1.0, -1.0]
        rate = SKELETON_RATE_HZ if rate_hz is None else rate_hz
        return track_from_points(file.stem, points, rate, rate_assumed=rate_hz is None)
    raise InputError(
        f"{file}: expected the arrays points or angles_rad, and rate_hz (and length_m); or "
        f"skeletons; found {', '.join(sorted(held)) or 'none'}"
    )


def load_npy(file: Path, rate_hz: float | None) -> Track:
    """Load joint angles (T, J), rad, column 0 next to the head; see ``formats.load_file``.

    Positive bends the head side to the left. Where the body was and faced is not in such a file:
    every frame faces along x in the mean, its head at the origin.
    """
    try:
        held = np.load(file, allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise InputError(f"{file}: is not an .npy of plain numbers: {error}") from None
    joints = _floats(file, "joint angles", np.asarray(held))
    if joints.ndim != 2 or joints.shape[1] < 3:
        raise InputError(f"{file}: expected joint angles (frames, 3 or more joints), {_is(joints)}")
    link_rad = np.concatenate([np.zeros((len(joints), 1)), -np.cumsum(joints, axis=1)], axis=1)
    points = body_points(link_rad - link_rad.mean(axis=1, keepdims=True))
    rate = JOINT_RATE_HZ if rate_hz is None else rate_hz
    return track_from_points(file.stem, points, rate, rate_assumed=rate_hz is None)


def _floats(file: Path, what: str, values: NDArray[np.generic]) -> Floats:
    if values.dtype.kind not in "fiu":
        raise InputError(f"{file}: {what}: expected numbers, not {values.dtype}")
    return np.asarray(values, dtype=float)


def _scalar(file: Path, what: str, value: NDArray[np.generic]) -> float:
    number = _floats(file, what, value)
    if number.size != 1:
        raise InputError(f"{file}: {what}: expected one number, {_is(number)}")
    return float(number.reshape(()))


def _is(values: Floats) -> str:
    return f"not an array of shape {values.shape}"
