"""Postures of a fish over time: the result of matching and the input of segmentation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.model import STATIONS, FishModel, pitched, turn_shares
from snakewalk.controller.track.resample import SEGMENTS, equal_arc_length, tangent_angles
from snakewalk.controller.track.track import Track


@dataclass(frozen=True, slots=True)
class Postures:
    """One posture a frame; a frame without a match is NaN throughout."""

    base: Floats
    """(T, 2) base of the head, x right, y up; body lengths, or m where ``length_m`` is known."""
    head_rad: Floats
    """(T,) direction of the head, unwrapped over time."""
    angles_rad: Floats
    """(T, J) spine angles A0..; positive: the head side is turned left."""
    joints_at: tuple[float, ...]
    """(J,) where on the body they are, in body lengths from the snout."""
    rate_hz: float
    """Frames a second."""
    length_m: float | None = None
    """Body length; None where the recording has no scale."""
    height: Floats | None = None
    """(T,) height of the base, from a side view, in the unit of ``base``."""
    pitch_rad: Floats | None = None
    """(T,) how far the head is lifted, from a side view."""
    value: Floats | None = None
    """(T,) V of Eq. 3; at most 1 + W."""
    model: FishModel | None = None
    """The matched fish; None for tracked midlines."""
    name: str = "fish"
    source: str = "not stated"
    licence: str = "not stated"

    @property
    def frames(self) -> int:
        """Frames T."""
        return len(self.head_rad)

    @property
    def found(self) -> Bools:
        """(T,) whether there is a posture."""
        return np.isfinite(self.head_rad)

    @property
    def length(self) -> float:
        """Body length in the unit of ``base``."""
        return 1.0 if self.length_m is None else self.length_m

    def tangents_rad(self) -> Floats:
        """(T, 100) tangent angles of the skeleton, head first."""
        return tangents(self.head_rad, self.angles_rad, self.joints_at)

    def points(self) -> Floats:
        """(T, 101, 2) skeleton in the unit of ``base``."""
        return skeleton(self.base, self.tangents_rad(), self.joints_at[0], self.length)

    def points_in_space(self) -> Floats:
        """(T, 101, 3) skeleton with height and pitch; level at 0 where they were not seen."""
        level = np.zeros(self.frames)
        pitch = level if self.pitch_rad is None else self.pitch_rad
        height = level if self.height is None else self.height
        base = np.column_stack([self.base, height])[:, None]
        return pitched(self.points() - base[..., :2], self.head_rad, pitch) + base


def tangents(head_rad: Floats, angles_rad: Floats, joints_at: tuple[float, ...]) -> Floats:
    """(T, 100) tangent angles of heads (T,) and spine angles (T, J)."""
    return head_rad[:, None] - angles_rad @ turn_shares(joints_at, SEGMENTS).T


def skeleton(base: Floats, tangents_rad: Floats, base_at: float, length: float) -> Floats:
    """(T, 101, 2) points of bodies whose place ``base_at`` along them lies at ``base`` (T, 2)."""
    step = np.stack([np.cos(tangents_rad), np.sin(tangents_rad)], axis=-1) * (length / SEGMENTS)
    points = np.zeros((len(base), SEGMENTS + 1, 2))
    points[:, 1:] = -np.cumsum(step, axis=1)
    return points + (base - _place_on(points, base_at))[:, None, :]


def _place_on(points: Floats, at: float) -> Floats:
    """(T, 2) places at a share of the length of skeletons (T, 101, 2)."""
    low, share = divmod(at * SEGMENTS, 1.0)
    return points[:, int(low)] * (1.0 - share) + points[:, int(low) + 1] * share


def fit_angles(tangents_rad: Floats, joints_at: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Head direction (T,) and spine angles (T, J) nearest to tangent angles (T, N)."""
    turns = turn_shares(joints_at, tangents_rad.shape[1])
    basis = np.column_stack([np.ones(len(turns)), -turns])
    solution = np.linalg.lstsq(basis, tangents_rad.T, rcond=None)[0]
    return np.asarray(solution[0]), np.asarray(solution[1:].T)


def postures_of_track(track: Track, joints_at: tuple[float, ...]) -> Postures:
    """Read postures off tracked midlines: no images needed; frames that are missing are NaN."""
    head, angles = fit_angles(track.angles_rad, joints_at)
    base = _place_on(np.stack([equal_arc_length(body) for body in track.points]), joints_at[0])
    frame = np.rint((track.time_s - track.time_s[0]) * track.rate_hz).astype(int)
    total = int(frame[-1]) + 1

    def spread(values: Floats) -> Floats:
        out = np.full((total, *values.shape[1:]), np.nan)
        out[frame] = values
        return out

    return Postures(
        base=spread(base),
        head_rad=spread(head),
        angles_rad=spread(angles),
        joints_at=joints_at,
        rate_hz=track.rate_hz,
        length_m=track.length_m,
        name=track.name,
        source=track.source,
        licence=track.licence,
    )


def midline_angles(points: Floats, joints_at: tuple[float, ...]) -> tuple[float, Floats]:
    """Head direction and spine angles (J,) of one midline (P, 2), snout first."""
    head, angles = fit_angles(tangent_angles(equal_arc_length(points))[None], joints_at)
    return float(head[0]), angles[0]


_POSTURES = {"base", "head_rad", "angles_rad_spine", "joints_at", "rate_hz"}
_SECTIONS = ("half_width", "half_height")


def save_postures(path: Path, postures: Postures, **more: Any) -> None:
    """Write postures with their skeletons, so that the file is a recording for a run as well.

    ``more`` are further arrays, such as the joints (T, joints) of one robot.
    """
    optional = {
        key: values
        for key in ("height", "pitch_rad", "value")
        if (values := getattr(postures, key)) is not None
    }
    if postures.model is not None:
        names = ("build", "length_px", "fin", *_SECTIONS)
        optional |= {key: getattr(postures.model, key) for key in names}
    with path.open("wb") as stream:  # a path would get .npz appended where it ends in .NPZ
        np.savez_compressed(
            stream,
            points=postures.points(),
            base=postures.base,
            head_rad=postures.head_rad,
            angles_rad_spine=postures.angles_rad,
            joints_at=postures.joints_at,
            rate_hz=postures.rate_hz,
            length_m=np.nan if postures.length_m is None else postures.length_m,
            name=postures.name,
            source=postures.source,
            licence=postures.licence,
            **optional,
            **more,
        )


def load_postures(path: Path) -> Postures:
    """Read what ``save_postures`` wrote.

    Raises:
        InputError: no such file, or not one of ours.

    """
    try:
        arrays, _ = read_arrays(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; snakewalk animal fish match writes one") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; postures are an .npz") from None
    except (ValueError, OSError):
        raise InputError(
            f"{path}: holds no postures; snakewalk animal fish match writes them, as .npz"
        ) from None
    missing = _POSTURES - arrays.keys()
    if missing:
        raise InputError(
            f"{path}: lacks {', '.join(sorted(missing))}; "
            "postures come from snakewalk animal fish match"
        )
    length_m = float(arrays.get("length_m", np.array(np.nan)))
    joints_at = tuple(float(joint) for joint in arrays["joints_at"])
    return Postures(
        base=arrays["base"],
        head_rad=arrays["head_rad"],
        angles_rad=arrays["angles_rad_spine"],
        joints_at=joints_at,
        rate_hz=float(arrays["rate_hz"]),
        length_m=length_m if np.isfinite(length_m) else None,
        height=arrays.get("height"),
        pitch_rad=arrays.get("pitch_rad"),
        value=arrays.get("value"),
        model=_model(path, arrays, joints_at),
        name=str(arrays.get("name", path.stem)),
        source=str(arrays.get("source", "not stated")),
        licence=str(arrays.get("licence", "not stated")),
    )


def holds_postures(path: Path) -> bool:
    """Whether a file is an .npz of postures, or of a motion made of them."""
    return _names(path) >= _POSTURES


def holds_fish(path: Path) -> bool:
    """Whether the file also contains the matched fish."""
    return holds_postures(path) and _names(path) >= {*_SECTIONS}


def _names(path: Path) -> set[str]:
    """Names of its arrays; empty for files of other formats."""
    try:
        return set() if path.suffix != ".npz" else set(read_arrays(path, ())[1])
    except (ValueError, OSError):
        return set()


def _model(path: Path, arrays: dict[str, Any], joints_at: tuple[float, ...]) -> FishModel | None:
    """The matched fish, if the file contains it."""
    if not arrays.keys() >= {*_SECTIONS, "build", "length_px"}:
        return None
    wide, high = (np.asarray(arrays[key], float) for key in _SECTIONS)
    if any(
        profile_values.shape != (STATIONS,) or not np.isfinite(profile_values).all()
        for profile_values in (wide, high)
    ):
        raise InputError(f"{path}: {' and '.join(_SECTIONS)} must be {STATIONS} numbers each")
    size = float(arrays["length_px"])
    fin = float(arrays.get("fin", 0.0))
    return FishModel(size, joints_at, wide, high, str(arrays["build"]), fin)
