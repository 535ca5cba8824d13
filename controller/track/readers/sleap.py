"""SLEAP's files: its table (CSV), its analysis HDF5, and its projects (``.slp``).

The analysis HDF5 is column-major for MATLAB: h5py sees ``tracks`` as (tracks, 2, nodes, frames) and
``point_scores`` as (tracks, nodes, frames); ``node_names`` and ``track_names`` are bytes. A project
holds tables ``frames``, ``instances`` and ``points`` (set by hand) or ``pred_points`` that index
each other, and names as JSON. Pixel rows count downwards.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.archive import parse_json
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.track import MOST_FRAMES, frame_numbers

_DOWNWARDS = np.array([1.0, -1.0])
_CENTRED_VERSION = 1.1  # format from which whole numbers are pixel centres, not corners
_PREDICTED_TYPE = 1
_NO_TRACK = "no track"


def load_table(
    file: Path,
    nodes: list[str],
    animal_names: list[str],
    frame: Floats,
    xy: Floats,
    scores: Floats | None,
    choice: Choice,
) -> Keypoints:
    """Load the CSV's columns.

    Args:
        file: for faults and the name.
        nodes: names of the K keypoints.
        animal_names: track name of each of T rows.
        frame: (T,) frame numbers.
        xy: (T, K, 2) pixels.
        scores: (T, K) scores of the keypoints.
        choice: animal and order of the midline.

    """
    if not np.isfinite(frame).all():
        raise InputError(f"{file}: frame_idx must be given in every row")
    names = list(dict.fromkeys(name or _NO_TRACK for name in animal_names))
    is_animal = np.array([name or _NO_TRACK for name in animal_names]) == choice.animal(
        file, names, names
    )
    frame = frame[is_animal]
    xy = xy[is_animal]
    scores = None if scores is None else scores[is_animal]
    order = _one_a_frame(file, frame, scores)
    return Keypoints(
        file,
        nodes,
        xy[order] * _DOWNWARDS,
        None if scores is None else scores[order],
        frame=frame_numbers(str(file), frame[order]),
    )


def _one_a_frame(file: Path, frame: Floats, scores: Floats | None) -> Ints:
    """Indices of rows by frame: a row set by hand (without scores) replaces the prediction."""
    by_hand = np.zeros(len(frame), bool)
    if scores is not None:
        by_hand[:] = np.isnan(scores).all(axis=1)
    order = np.lexsort((~by_hand, frame))
    again = np.asarray(np.diff(frame[order], prepend=np.nan) == 0.0)
    if np.any(again & (by_hand[order] == by_hand[np.roll(order, 1)])):
        raise InputError(f"{file}: more than one animal of one name in a frame; export one track")
    return np.asarray(order[~again])


def load_analysis(
    file: Path,
    h5_file: Any,
    choice: Choice,
) -> Keypoints:
    """Load the open analysis HDF5 ``h5_file``; see ``load.load_file``."""
    tracks = _in_order(h5_file["tracks"], ("track", "xy", "node", "frame"))
    nodes = _names(h5_file, "node_names")
    if tracks.ndim != 4 or tracks.shape[1] != 2 or len(nodes) not in (0, tracks.shape[2]):
        raise InputError(
            f"{file}: tracks: expected (tracks, 2, nodes, frames) as SLEAP writes it, not an array "
            f"of shape {tracks.shape}" + (f" of {len(nodes)} nodes" if nodes else "")
        )
    names = _names(h5_file, "track_names")
    if len(names) != len(tracks):
        names = [f"track_{k}" for k in range(len(tracks))]
    animals_with_points = [
        names[k] for k in np.flatnonzero(np.isfinite(tracks).any(axis=(1, 2, 3)))
    ]
    animal_index = names.index(choice.animal(file, names, animals_with_points))
    scores = None
    if "point_scores" in h5_file:
        stored = _in_order(h5_file["point_scores"], ("track", "node", "frame"))
        if stored.shape != (tracks.shape[0], *tracks.shape[2:]):
            raise InputError(
                f"{file}: point_scores: expected (tracks, nodes, frames), not {stored.shape}"
            )
        scores = stored[animal_index].T
    return Keypoints(
        file,
        nodes or [f"node_{k}" for k in range(tracks.shape[2])],
        tracks[animal_index].transpose(2, 1, 0) * _DOWNWARDS,
        scores,
        rate_hz=_stated_rate(h5_file),
    )


def _in_order(stored: Any, axes: tuple[str, ...]) -> Floats:
    values = np.asarray(stored[:], dtype=float)
    named = _json_attribute(stored, "dims")
    if not isinstance(named, list) or {*map(str, named)} != {*axes} or values.ndim != len(named):
        return values
    return values.transpose([named.index(axis) for axis in axes])


def _stated_rate(h5_file: Any) -> float | None:
    about = _json_attribute(h5_file, "video_backend_metadata")
    rate = about.get("fps") if isinstance(about, dict) else None
    return float(rate) if isinstance(rate, int | float) and rate > 0.0 else None


def _json_attribute(h5_file: Any, name: str) -> Any:
    """Content of a JSON attribute; None if it is missing or invalid."""
    try:
        return parse_json(_text(h5_file.attrs[name]))
    except (KeyError, ValueError):
        return None


def load_project(
    file: Path,
    h5_file: Any,
    choice: Choice,
) -> Keypoints:
    """Load the open project ``h5_file`` (.slp); see ``load.load_file``."""
    try:
        about = parse_json(_text(h5_file["metadata"].attrs["json"]))
        version = float(h5_file["metadata"].attrs.get("format_id", 1.0))
        skeletons = [
            [str(about["nodes"][int(node["id"])]["name"]) for node in skeleton["nodes"]]
            for skeleton in about["skeletons"]
        ]
        tracks = [str(parse_json(_text(track_json))[1]) for track_json in h5_file["tracks_json"][:]]
        frames = h5_file["frames"][:]
        instances = h5_file["instances"][:]
        tables = {False: h5_file["points"][:], True: h5_file["pred_points"][:]}
        stated = _rate(h5_file)
    except (KeyError, ValueError, TypeError, IndexError, AttributeError) as error:
        raise InputError(f"{file}: is no SLEAP project that can be read: {error}") from None
    if len({int(v) for v in frames["video"]}) > 1:
        raise InputError(f"{file}: holds several videos; export the labels of one")
    if len({int(k) for k in instances["skeleton"]}) != 1:
        raise InputError(f"{file}: expected one skeleton, found {len(skeletons)}")
    nodes = skeletons[int(instances["skeleton"][0])]
    names = [*tracks, _NO_TRACK]
    number = {int(frame["frame_id"]): int(frame["frame_idx"]) for frame in frames}
    animal_names = [
        names[int(k)] if 0 <= k < len(tracks) else _NO_TRACK for k in instances["track"]
    ]
    animals = list(dict.fromkeys(animal_names))
    is_animal = choice.animal(file, animals, animals)
    last = max(number.values(), default=-1)
    if not 0 <= last < MOST_FRAMES:
        raise InputError(f"{file}: a frame's number is {last}; at most {MOST_FRAMES} are read")
    places = np.full((last + 1, len(nodes), 2), np.nan)
    scores = np.full((last + 1, len(nodes)), np.nan)
    by_hand = np.zeros(last + 1, dtype=bool)
    taken = np.zeros(last + 1, dtype=bool)
    shift = 0.0 if version >= _CENTRED_VERSION else -0.5
    for instance, name in zip(instances, animal_names, strict=True):
        if name != is_animal:
            continue
        row_index = number.get(int(instance["frame_id"]), -1)
        predicted = int(instance["instance_type"]) == _PREDICTED_TYPE
        rows = tables[predicted][int(instance["point_id_start"]) : int(instance["point_id_end"])]
        if row_index < 0 or len(rows) != len(nodes):
            raise InputError(f"{file}: an instance has {len(rows)} points of {len(nodes)}")
        if taken[row_index] and by_hand[row_index] == (not predicted):
            raise InputError(
                f"{file}: two animals without a track in frame {row_index}: "
                "track them first in SLEAP"
                if is_animal == _NO_TRACK
                else f"{file}: {is_animal} is twice in frame {row_index}; correct it in SLEAP"
            )
        if taken[row_index] and predicted:
            continue  # a row set by hand replaces the prediction
        taken[row_index], by_hand[row_index] = True, not predicted
        hidden = ~np.asarray(rows["visible"], dtype=bool)
        places[row_index] = np.column_stack([rows["x"], rows["y"]]) + shift
        places[row_index, hidden] = np.nan
        scores[row_index] = rows["score"] if predicted else np.nan
    return Keypoints(
        file,
        nodes,
        places * _DOWNWARDS,
        scores,
        rate_hz=stated,
    )


def _rate(h5_file: Any) -> float | None:
    for video_json in h5_file["videos_json"][:] if "videos_json" in h5_file else []:
        rate = parse_json(_text(video_json)).get("backend", {}).get("fps")
        if rate:
            return float(rate)
    return None


def _names(h5_file: Any, what: str) -> list[str]:
    return [_text(name) for name in h5_file[what][:]] if what in h5_file else []


def _text(value: bytes | str | NDArray[np.generic]) -> str:
    plain = value.item() if isinstance(value, np.ndarray | np.generic) else value
    return plain.decode("utf-8", "replace") if isinstance(plain, bytes) else str(plain)
