"""Tracks as tables and WCON, for other programs; the readers of this package read both back."""

import csv
import json
from pathlib import Path
from typing import Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.track import Track

SUFFIXES: Final = (".npz", ".csv", ".wcon")
"""File name endings of a track that can be written."""
_DIGITS: Final = 7


def write_track(path: Path, track: Track, suffix: str) -> None:
    """Write a track in the format of a suffix.

    Raises:
        InputError: none of ``SUFFIXES``.

    """
    match suffix.lower():
        case ".npz":
            save_track(path, track)
        case ".csv":
            _write_csv(path, track)
        case ".wcon":
            _write_wcon(path, track)
        case _:
            raise InputError(f"{path}: a track is written as one of {', '.join(SUFFIXES)}")


def _write_csv(path: Path, track: Track) -> None:
    """Write rows of t, frame, point (1 is the head) and place, for R, MATLAB and others.

    Columns are ``x_m, y_m``, or ``x_lengths, y_lengths`` where the recording has no scale. Frames
    that are missing have no rows.
    """
    unit = "lengths" if track.length_m is None else "m"
    number = np.rint(track.time_s * track.rate_hz).astype(int).tolist()
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["t", "frame", "point", f"x_{unit}", f"y_{unit}"])
        for frame, body in zip(number, track.points.tolist(), strict=True):
            time_s = f"{frame / track.rate_hz:.{_DIGITS}f}"
            for point, (x, y) in enumerate(body, start=1):
                writer.writerow([time_s, frame, point, f"{x:.{_DIGITS}g}", f"{y:.{_DIGITS}g}"])


def _write_wcon(path: Path, track: Track) -> None:
    """Write a WCON of one animal for Tierpsy and others; a body without a scale has unit 1."""
    unit = "1" if track.length_m is None else "m"
    about = {
        "software": {"name": "snakewalk"},
        "source": track.source,
        "licence": track.licence,
        "rate_hz": track.rate_hz,
        "rate_assumed": track.rate_assumed,
        "frames_left_out": track.dropped,
        "frames_missing": track.absent,
        "notes": list(track.notes),
    }
    held = {
        "units": {"t": "s", "x": unit, "y": unit},
        "metadata": about,
        "data": [
            {
                "id": track.name,
                "t": np.round(track.time_s, _DIGITS).tolist(),
                "x": _rounded(track.points[..., 0]),
                "y": _rounded(track.points[..., 1]),
                "head": "L",
            }
        ],
    }
    path.write_text(json.dumps(held), encoding="utf-8")


def _rounded(values: Floats) -> list[list[float]]:
    return [[float(f"{v:.{_DIGITS}g}") for v in row] for row in values.tolist()]
