"""SLEAP's files: its table (CSV) and its analysis HDF5.

The HDF5 is written column-major for MATLAB, so h5py sees ``tracks`` as (tracks, 2, nodes, frames)
and ``point_scores`` as (tracks, nodes, frames); ``node_names`` and ``track_names`` are bytes. Pixel
rows count downwards, and no file holds a frame rate.
"""

from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.readers.keypoints import track_from_keypoints
from snakewalk.controller.capture.track import Track, frame_numbers


def load_table(
    file: Path,
    frame: Floats,
    xy: Floats,
    scores: Floats | None,
    rate_hz: float | None,
    least_score: float | None,
) -> Track:
    """Load the CSV's columns: frame numbers (T,), x and y (T, K, 2), scores (T, K) or None."""
    if not np.isfinite(frame).all():
        raise InputError(f"{file}: frame_idx must be given in every row")
    if len(np.unique(frame)) < len(frame):
        raise InputError(f"{file}: more than one animal in a frame; export one track")
    order = np.argsort(frame, kind="stable")
    return track_from_keypoints(
        file,
        xy[order],
        None if scores is None else scores[order],
        rate_hz=rate_hz,
        least_score=0.0 if least_score is None else least_score,
        frame=frame_numbers(str(file), frame[order]),
    )


def load_analysis(
    file: Path,
    held: Any,
    rate_hz: float | None,
    least_score: float | None,
) -> Track:
    """Load the open analysis HDF5 ``held``; see ``load.load_file``."""
    tracks = np.asarray(held["tracks"][:], dtype=float)
    nodes = len(held["node_names"]) if "node_names" in held else None
    if tracks.ndim != 4 or tracks.shape[1] != 2 or nodes not in (None, tracks.shape[2]):
        raise InputError(
            f"{file}: tracks: expected (tracks, 2, nodes, frames) as SLEAP writes it, not an array "
            f"of shape {tracks.shape}" + ("" if nodes is None else f" of {nodes} nodes")
        )
    seen = np.flatnonzero(np.isfinite(tracks).any(axis=(1, 2, 3)))
    if len(seen) != 1:
        names = ", ".join(
            name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
            for name in (held["track_names"][:] if "track_names" in held else [])
        )
        raise InputError(
            f"{file}: {len(seen)} animals in it" + (f" ({names})" if names else "") + "; export one"
        )
    one = int(seen[0])
    scores = None
    if "point_scores" in held:
        stored = np.asarray(held["point_scores"][:], dtype=float)
        if stored.shape != (tracks.shape[0], *tracks.shape[2:]):
            raise InputError(
                f"{file}: point_scores: expected (tracks, nodes, frames), not {stored.shape}"
            )
        scores = stored[one].T
    return track_from_keypoints(
        file,
        tracks[one].transpose(2, 1, 0),
        scores,
        rate_hz=rate_hz,
        least_score=0.0 if least_score is None else least_score,
    )
