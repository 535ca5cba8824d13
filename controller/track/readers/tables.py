"""Recordings as tables: midlines point by point, keypoints frame by frame."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.file_units import TIMES_S, named_unit, unit_m
from snakewalk.config.reading import by_names, by_user
from snakewalk.config.table_columns import preview, with_meanings
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.motion.joint_motion import time_unit
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus, statuses_named
from snakewalk.controller.track.readers.deeplabcut import is_deeplabcut, load_rows
from snakewalk.controller.track.readers.formats import KNOWN
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.readers.marker_tables import (
    is_motive,
    is_vicon,
    load_motive,
    load_vicon,
)
from snakewalk.controller.track.readers.sleap import load_table
from snakewalk.controller.track.track import Track, frame_numbers, track_from_points

_PLACE = re.compile(r"(m?)x_?(m|[a-z]{2,})(_1)?")
"""Column of places: x, their unit, and in wide rows the number of the first point."""
_NO_LENGTHS = ("lengths", "px")
"""Body lengths and pixels, which have no scale."""


def load_csv(file: Path, choice: Choice) -> Track | Keypoints:
    """Load any of these kinds of CSV; see ``load.load_file``."""
    notes: list[str] = []
    every = read_rows(file, f"recording (known: {KNOWN})")
    every = with_meanings(file, every, choice.columns, notes)
    loaded = _of_rows(file, every, choice)
    return replace(loaded, notes=(*notes, *loaded.notes))


def _of_rows(file: Path, every: list[list[str]], choice: Choice) -> Track | Keypoints:
    if is_vicon(every):
        return load_vicon(file, every, choice)
    if is_motive(every):
        return load_motive(file, every, choice)
    rows = [row for row in every if row]
    if len(rows) < 2:
        raise InputError(f"{file}: expected a line of column names, then rows of numbers")
    if is_deeplabcut(rows):
        return load_rows(file, rows, choice)
    column = {name.strip(): index for index, name in enumerate(rows[0])}
    for name in column:
        place = _PLACE.fullmatch(name)
        unit = named_unit(place[2]) if place else None
        if place is None or (unit is None and place[2] not in _NO_LENGTHS):
            continue
        pair = name.replace("x", "y", 1)
        other = f"{name[:-1]}4" if place[3] else "point"
        if not {"t", "frame", other, pair} <= column.keys():
            continue
        rows = _of_animal(file, rows, column, choice)
        table = (
            _long_table(file, rows, column, place[2])
            if place[3]
            else _numbers(file, rows, [column[n] for n in ("t", "frame", other, name, pair)])
        )
        scale_m = None if unit is None else unit_m(unit)
        track = _midline(file, table, scale_m, choice, _status_of(rows, column))
        fact = by_names(unit, [name], choice.columns)
        track = replace(track, facts={} if fact is None else {"unit": fact})
        return _named_track(file, track, rows, column)
    keypoints = [name[:-2] for name in column if name.endswith(".x") and f"{name[:-2]}.y" in column]
    if keypoints and "frame_idx" in column:
        return _sleap(file, rows, column, keypoints, choice)
    raise InputError(
        [
            f"{file}: expected t, frame, point, x_m, y_m (or x_mm, y_mm; mxmm, mymm), SLEAP's "
            "frame_idx and <keypoint>.x, <keypoint>.y, or DeepLabCut's scorer, bodyparts and "
            f"coords; found {', '.join(rows[0][:6])[:80]}; add --columns MEANING=COLUMN",
            *preview(rows),
        ]
    )


def _of_animal(
    file: Path, rows: list[list[str]], column: dict[str, int], choice: Choice
) -> list[list[str]]:
    animals = column.get("animal")
    if animals is None:
        choice.only(file, "a CSV of midlines", "time_unit")
        return rows
    choice.only(file, "a CSV of midlines", "individual", "time_unit")
    names = _cells(rows, animals)
    listed = list(dict.fromkeys(names))
    name_of_animal = choice.animal(file, listed, listed)
    return [
        rows[0],
        *(row for row, name in zip(rows[1:], names, strict=True) if name == name_of_animal),
    ]


def _status_of(rows: list[list[str]], column: dict[str, int]) -> dict[float, FrameStatus]:
    """Status of each frame by its number; empty if the table does not state it."""
    if "status" not in column:
        return {}
    numbers = map(float, _cells(rows, column["frame"]))
    named_statuses = statuses_named(_cells(rows, column["status"]))
    return dict(zip(numbers, named_statuses, strict=True)) if named_statuses else {}


def _named_track(file: Path, track: Track, rows: list[list[str]], column: dict[str, int]) -> Track:
    """The track with the animal's name and with the certainty of its head, where stated."""
    if "head_sure" in column:
        sure = float(_numbers(file, rows[:2], [column["head_sure"]])[0, 0])
        track = replace(track, head_sure=sure if np.isfinite(sure) else None)
    if "animal" in column:
        track = replace(track, name=rows[1][column["animal"]].strip())
    return track


def _long_table(file: Path, rows: list[list[str]], column: dict[str, int], unit: str) -> Floats:
    count = 1
    while {f"x_{unit}_{count + 1}", f"y_{unit}_{count + 1}"} <= column.keys():
        count += 1
    names = [f"{axis}_{unit}_{point + 1}" for point in range(count) for axis in "xy"]
    table = _numbers(file, rows, [column[name] for name in ("t", "frame", *names)])
    first = np.repeat(table[:, :2], count, axis=0)
    point = np.tile(np.arange(1.0, count + 1.0), len(table))[:, None]
    return np.hstack([first, point, table[:, 2:].reshape(-1, 2)])


def _cells(rows: list[list[str]], column: int) -> list[str]:
    """Cells of a column below its name; empty where a row is short."""
    return [row[column].strip() if column < len(row) else "" for row in rows[1:]]


def _numbers(file: Path, rows: list[list[str]], columns: list[int]) -> Floats:
    """Cells as numbers (rows, columns); empty ones and NA are NaN."""
    cells = zip(*(_cells(rows, k) for k in columns), strict=True)
    return numbers_of(file, cells, [rows[0][k] for k in columns], range(2, len(rows) + 1))


def _midline(
    file: Path,
    table: Floats,
    scale_m: float | None,
    choice: Choice,
    status: dict[float, FrameStatus],
) -> Track:
    """Track from rows of t, frame, point (1 is the head), x, y."""
    if not np.isfinite(table[:, :3]).all():
        lost = int((~np.isfinite(table[:, :3])).any(axis=1).sum())
        raise InputError(
            f"{file}: t, frame and point must be given in every row; {lost} of {len(table)} rows "
            "lack one, or have one that is not finite"
        )
    if len(np.unique(table[:, 1:3], axis=0)) < len(table):
        raise InputError(f"{file}: a point twice in a frame: more than one animal; export one")
    table = table[np.lexsort((table[:, 2], table[:, 1]))]
    frames, first, count = np.unique(table[:, 1], return_index=True, return_counts=True)
    if len(set(count.tolist())) != 1:
        frame = int(frames[np.flatnonzero(count != count[0])[0]])
        raise InputError(
            f"{file}: every frame must list the same points; frame {frame} differs from the first"
        )
    points = table[:, 3:].reshape(len(frames), int(count[0]), 2)
    time_s = None
    rate_hz = choice.rate
    if rate_hz is None:
        if len(frames) < 2:
            raise InputError(f"{file}: holds 1 frame; a motion needs at least 2")
        step = np.diff(table[first, 0]) / np.diff(frames)
        back = np.flatnonzero(~(step > 0.0))
        if len(back):
            raise InputError(
                f"{file}: t must increase from frame to frame, in seconds; it does not in "
                f"{len(back)} of {len(step)} steps, first after frame {frames[back[0]]:g}"
            )
        given = by_user("--time-unit", choice.time_unit)
        unit_s = TIMES_S[time_unit(file, np.cumsum(step), "t", given).value]
        rate_hz = float(1.0 / np.median(unit_s * step))
        time_s = unit_s * table[first, 0]
    return track_from_points(
        file.stem,
        points,
        rate_hz,
        scale_m=scale_m,
        frame=frame_numbers(str(file), frames),
        time_s=time_s,
        status=[status[frame] for frame in frames.tolist()] if status else (),
    )


def _sleap(
    file: Path,
    rows: list[list[str]],
    column: dict[str, int],
    keypoints: list[str],
    choice: Choice,
) -> Keypoints:
    """Keypoints in pixels, from one row per animal and frame, in the table's order."""
    columns = [column["frame_idx"], *(column[f"{k}.{axis}"] for k in keypoints for axis in "xy")]
    table = _numbers(file, rows, columns)
    score_columns = [column[f"{k}.score"] for k in keypoints if f"{k}.score" in column]
    scores = _numbers(file, rows, score_columns) if len(score_columns) == len(keypoints) else None
    xy = table[:, 1:].reshape(len(table), len(keypoints), 2)
    animal_names = _cells(rows, column["track"]) if "track" in column else [""] * len(table)
    return load_table(file, keypoints, animal_names, table[:, 0], xy, scores, choice)
