"""Writers of tracks as tables and WCON; the readers read both back."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.track import Track

SUFFIXES = (".npz", ".csv", ".wcon")
"""File name endings of a track that can be written."""


def write_track(path: Path, track: Track, suffix: str) -> None:
    """Write a track in the format of a suffix of ``SUFFIXES``."""
    if suffix.lower() == ".npz":
        save_track(path, track)
    else:
        write_tracks(path, [track], suffix)


def write_tracks(
    path: Path,
    tracks: Sequence[Track],
    suffix: str,
    *,
    wide: bool = False,
    unit: str | None = None,
) -> None:
    """Write the animals of one recording into a table or a WCON; numbers are not rounded.

    Args:
        path: of the file.
        tracks: one per animal, with different names.
        suffix: ``.csv`` or ``.wcon``.
        wide: a row of the table holds all points of a frame; else one point.
        unit: of the points: ``m``, ``px`` or ``lengths``; None: that of the tracks.

    Raises:
        InputError: a table of a recording without places.

    """
    if unit is None:
        unit = "lengths" if tracks[0].length_m is None else "m"
    if suffix.lower() == ".csv":
        _write_csv(path, tracks, unit, wide=wide)
    else:
        _write_wcon(path, tracks, unit)


def _write_csv(path: Path, tracks: Sequence[Track], unit: str, *, wide: bool) -> None:
    """Write rows of t, frame, point (1 is the head) and place.

    Columns are ``x_m, y_m``; without a scale ``x_lengths`` or ``x_px``. Wide rows have ``x_m_1,
    y_m_1, x_m_2`` and so on. Several animals add a column ``animal``. Missing frames have no rows.
    The last columns are ``status``, a word of ``FrameStatus``, and ``head_sure``, where known.
    """
    if not all(item_track.places_recorded for item_track in tracks):
        raise InputError(
            f"{path.name}: a .csv cannot state that places were not recorded; write an .npz or a "
            ".wcon"
        )
    several = len(tracks) > 1
    heads = ["t", "frame", *(["animal"] if several else [])]
    if wide:
        count = tracks[0].points.shape[1]
        heads += [f"{axis}_{unit}_{point + 1}" for point in range(count) for axis in "xy"]
    else:
        heads += ["point", f"x_{unit}", f"y_{unit}"]
    has_status = any(item_track.status for item_track in tracks)
    has_sure = any(item_track.head_sure is not None for item_track in tracks)
    heads += [*(["status"] if has_status else []), *(["head_sure"] if has_sure else [])]
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        for track in tracks:
            number = np.rint(track.time_s * track.rate_hz).astype(int).tolist()
            words = [frame_status.name.lower() for frame_status in track.status] or [""] * len(
                number
            )
            sure = ["" if track.head_sure is None else track.head_sure] if has_sure else []
            bodies = (body.tolist() for body in track.points)
            for frame, body, word in zip(number, bodies, words, strict=True):
                first = [frame / track.rate_hz, frame, *([track.name] if several else [])]
                last = [*([word] if has_status else []), *sure]
                if wide:
                    writer.writerow([*first, *(value for place in body for value in place), *last])
                    continue
                writer.writerows(
                    [*first, point, *place, *last] for point, place in enumerate(body, start=1)
                )


def _write_wcon(path: Path, tracks: Sequence[Track], unit: str) -> None:
    """Write a WCON frame by frame; bodies without a scale have unit 1.

    ``@snakewalk`` of a record states the status of each frame, ``head_sure`` and its source.
    """
    first = tracks[0]
    about = {
        "software": {"name": "snakewalk"},
        "source": first.source,
        "licence": first.licence,
        "unit_of_length": unit,
        "rate_hz": first.rate_hz,
        "rate_assumed": first.rate_assumed,
        "frames_left_out": sum(track.dropped for track in tracks),
        "frames_missing": sum(track.absent for track in tracks),
        "notes": list(dict.fromkeys(note for track in tracks for note in track.notes)),
        "places_recorded": all(track.places_recorded for track in tracks),
    }
    units = {"t": "s"} | dict.fromkeys("xy", "m" if unit == "m" else "1")
    with path.open("w", encoding="utf-8") as stream:
        stream.write(f'{{"units": {json.dumps(units)}, "metadata": {json.dumps(about)}, "data": [')
        for number, track in enumerate(tracks):
            facts = {
                "status": [status.name.lower() for status in track.status],
                "head_sure": track.head_sure,
                "source": track.source,
            }
            stream.write(", " if number else "")
            stream.write(
                f'{{"id": {json.dumps(track.name)}, "t": {json.dumps(track.time_s.tolist())}'
            )
            for axis, name in enumerate("xy"):
                stream.write(f', "{name}": [')
                for frame, body in enumerate(track.points):
                    stream.write(", " if frame else "")
                    stream.write(json.dumps(body[:, axis].tolist()))
                stream.write("]")
            stream.write(f', "head": "L", "@snakewalk": {json.dumps(facts)}}}')
        stream.write("]}")
