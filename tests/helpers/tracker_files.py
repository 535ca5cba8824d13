"""Files of keypoints in the documented layouts of SLEAP and DeepLabCut.

Each writer accepts places (T, K, 2), px, with rows downwards, and scores (T, K).
"""

import pickle
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from snakewalk.config.arrays import Floats


def node_names(places_px: Floats) -> list[str]:
    return [f"p{k}" for k in range(places_px.shape[1])]


def dlc_rows(
    places_px: Floats, scores: Floats, individuals: str | None = None
) -> tuple[list[list[str]], Floats]:
    """Header and values (T, 3 K) as pandas writes DeepLabCut's columns."""
    coords = ["x", "y", "likelihood"]
    frames, points = scores.shape
    head = [["scorer"] + ["DLC_resnet50_eel"] * 3 * points]
    if individuals:
        head.append(["individuals"] + [individuals] * 3 * points)
    head.append(["bodyparts"] + [name for name in node_names(places_px) for _ in coords])
    head.append(["coords"] + coords * points)
    values = np.concatenate([places_px, scores[..., None]], axis=2)
    return head, np.asarray(values.reshape(frames, 3 * points))


def dlc_csv(path: Path, places_px: Floats, scores: Floats, individuals: str | None = None) -> None:
    head, values = dlc_rows(places_px, scores, individuals)
    rows = [",".join(map(str, row)) for row in head]
    rows += [f"{k}," + ",".join(map(repr, row)) for k, row in enumerate(values.tolist())]
    path.write_text("\n".join(rows).replace("nan", "") + "\n")


def dlc_h5(
    path: Path,
    places_px: Floats,
    scores: Floats,
    individuals: str | None = None,
    columns: Any = None,
    protocol: int = 0,
) -> None:
    """The table that pandas writes; ``columns`` replace the names of its columns."""
    head, values = dlc_rows(places_px, scores, individuals)
    names = list(zip(*(row[1:] for row in head), strict=True)) if columns is None else columns
    kind = np.dtype([("index", "<i8"), ("values_block_0", "<f8", (values.shape[1],))])
    table = np.zeros(len(values), kind)
    table["index"], table["values_block_0"] = np.arange(len(values)), values
    with h5py.File(path, "w") as file:
        group = file.create_group("df_with_missing")
        group.create_dataset("table", data=table)
        stored = names if isinstance(names, bytes) else pickle.dumps([(1, names)], protocol)
        group.attrs["non_index_axes"] = np.bytes_(stored) if protocol == 0 else np.void(stored)


def sleap_csv(path: Path, places_px: Floats, scores: Floats) -> None:
    names = [f"{name}.{axis}" for name in node_names(places_px) for axis in ("x", "y", "score")]
    rows = [["track", "frame_idx", "instance.score", *names]]
    values = np.concatenate([places_px, scores[..., None]], axis=2).reshape(len(scores), -1)
    for number, body in enumerate(values.tolist()):
        rows.append(["snake", str(number), "0.9", *map(repr, body)])
    path.write_text("\n".join(map(",".join, rows)).replace("nan", "") + "\n")


def sleap_h5(path: Path, places_px: Floats, scores: Floats, animals: int = 1) -> None:
    """Analysis file of up to two tracks; others of its animals lie 50 px apart."""
    tracks = np.full((*places_px.shape, 2), np.nan)
    for k in range(animals):
        tracks[..., k] = places_px + 50.0 * k
    marks = np.full((*scores.shape, 2), np.nan)
    marks[..., 0] = scores
    with h5py.File(path, "w") as file:  # transposed, as SLEAP does for MATLAB
        file["tracks"] = tracks.T
        file["track_occupancy"] = np.isfinite(tracks).any((1, 2)).astype(np.uint8)
        file["point_scores"] = marks.T
        file["node_names"] = [name.encode() for name in node_names(places_px)]
        file["track_names"] = [b"eel", b"other"]
