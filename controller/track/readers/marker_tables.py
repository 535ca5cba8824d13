"""Marker trajectories as tables: Vicon's CSV, OptiTrack's CSV (Motive) and OpenSim's TRC.

Vicon Nexus writes blocks. The marker block begins with ``Trajectories`` and the frame rate. Marker
names, column names (Frame, Sub Frame, X, Y, Z, ...), units and rows follow, up to an empty line. A
TRC has two lines of names and values (``DataRate``, ``Units``, ...), lines of marker and column
names, then rows of frame, time and places. A file of Motive begins with a
line of names and values (``Export Frame Rate``, ``Length Units``, ...). Rows of types, names and
other properties of its objects follow, then column names and rows of values.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Ints
from snakewalk.config.errors import InputError
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.readers.markers import (
    marker_places,
    number_or_none,
    projected,
)
from snakewalk.controller.track.track import frame_numbers

VICON_HEAD = "Trajectories"
_MOTIVE_KINDS = ("Marker", "Rigid Body", "Bone")
"""Types of objects whose measured places are used, in this order of preference."""
_SAME_RATE = 0.01
"""Share by which the rate of Motive's rounded times may differ from the stated one (ours)."""
_MOST_COLUMNS = 30_000


def is_trc(head: bytes) -> bool:
    """Whether a file with this head is a TRC."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(b"PathFileType")


def is_vicon(rows: list[list[str]]) -> bool:
    """Whether a CSV has a block of Vicon's marker trajectories."""
    return any(row and row[0].strip() == VICON_HEAD for row in rows)


def load_vicon(file: Path, rows: list[list[str]], choice: Choice) -> Keypoints:
    """Load Vicon's CSV; see ``load.load_file``."""
    begin = next(k for k, row in enumerate(rows) if row and row[0].strip() == VICON_HEAD)
    block = [(k + 1, row) for k, row in enumerate(rows)][begin + 1 :]
    if len(block) < 5:
        raise InputError(f"{file}: its block {VICON_HEAD} ends before its rows; export it again")
    stated = number_or_none((block[0][1] or [""])[0].strip())
    names = [cell.strip() for cell in block[1][1][2:] if cell.strip()]
    units = {cell.strip().lower() for cell in block[3][1][2:] if cell.strip()}
    if not names:
        raise InputError(f"{file}: line {block[1][0]}: expected the names of markers")
    if len(units) != 1:
        units_text = ", ".join(sorted(units)) or "none"
        raise InputError(
            f"{file}: line {block[3][0]}: expected one unit for all markers, found {units_text}"
        )
    data = []
    for line, row in block[4:]:
        if not any(cell.strip() for cell in row):
            break
        if row[0].strip() in {"Model Outputs", "Devices", "Segments", "Joints", VICON_HEAD}:
            break
        data.append((line, row))
    names = _short(names)
    frame = _frames(file, data)
    places = marker_places(file, [row[2:] for _, row in data], len(names), first_line=block[4][0])
    return projected(file, names, places, units.pop(), stated, choice, frame)


def is_motive(rows: list[list[str]]) -> bool:
    """Whether a CSV is an export of OptiTrack's Motive."""
    return bool(rows and rows[0]) and rows[0][0].strip() == "Format Version"


def load_motive(file: Path, rows: list[list[str]], choice: Choice) -> Keypoints:
    """Load Motive's CSV; see ``load.load_file``."""
    about = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    begin = next((k for k, row in enumerate(rows) if row and row[0].strip() == "Frame"), len(rows))
    heads = [row for row in rows[1 : begin + 1] if any(cell.strip() for cell in row)]
    if len(heads) < 4:
        raise InputError(f"{file}: expected rows of types, names and columns; export it again")
    if about.get("Coordinate Space", "Global") != "Global":
        raise InputError(f"{file}: its places are those in a parent's frame; export it in Global")
    kinds, names, *_, parts, axes = (
        [cell.strip() for cell in row + [""] * len(heads[-1])] for row in heads
    )
    starts: dict[str, list[int]] = {}
    for k in range(2, len(heads[-1])):
        if parts[k] == "Position" and axes[k : k + 3] == ["X", "Y", "Z"]:
            starts.setdefault(kinds[k], []).append(k)
    kind = next((kind for kind in _MOTIVE_KINDS if kind in starts), None)
    if kind is None:
        raise InputError(f"{file}: has no positions of markers; export them with it")
    data = [(line, row) for line, row in enumerate(rows[begin + 1 :], begin + 2) if any(row)]
    frame = _frames(file, data)
    cells = [[part for k in starts[kind] for part in row[k : k + 3]] for _, row in data]
    places = marker_places(file, cells, len(starts[kind]), first_line=begin + 2)
    times = numbers_of(file, [row[1:2] for _, row in data], ["Time"], (line for line, _ in data))
    rate_hz = float(np.median(np.diff(frame) / np.diff(times[:, 0])))
    stated = [number_or_none(about.get(f"{k} Frame Rate", "")) for k in ("Export", "Capture")]
    rates = [rate for rate in stated if rate]
    if choice.rate is None and not any(abs(rate / rate_hz - 1.0) < _SAME_RATE for rate in rates):
        listed = " and ".join(f"{rate:g}" for rate in rates) or "no"
        raise InputError(
            f"{file}: states {listed} frames a second, and its times {rate_hz:.4g}; give --rate"
        )
    keypoints = projected(
        file,
        _short([names[k] for k in starts[kind]]),
        places,
        about.get("Length Units", ""),
        rate_hz,
        choice,
        frame,
        ups="yz",
    )
    others = [f"{len(starts[other])} of type {other}" for other in starts if other != kind]
    notes = (f"left out: places {', '.join(others)}",) if others else ()
    return replace(keypoints, notes=(*notes, *keypoints.notes))


def _short(names: list[str]) -> list[str]:
    """Names without their subject, if they still differ."""
    short = [name.rsplit(":", 1)[-1] for name in names]
    return short if len(set(short)) == len(short) else names


def load_trc(file: Path, choice: Choice) -> Keypoints:
    """Load a TRC; see ``load.load_file``."""
    rows = read_rows(file, "TRC", "\t")
    if len(rows) < 6:
        raise InputError(f"{file}: expected the five head lines of a TRC, then rows")
    about = dict(zip((cell.strip() for cell in rows[1]), rows[2], strict=False))
    unit = about.get("Units", "").strip().lower()
    stated = number_or_none(about.get("DataRate", ""))
    names = [cell.strip() for cell in rows[3][2:] if cell.strip()]
    if not names or len(names) > _MOST_COLUMNS // 3:
        raise InputError(f"{file}: line 4: expected Frame#, Time and the names of markers")
    data = [
        (line, row)
        for line, row in enumerate(rows[4:], start=5)
        if row and number_or_none(row[0].strip()) is not None
    ]
    frame = _frames(file, data)
    first = data[0][0]
    places = marker_places(file, [row[2:] for _, row in data], len(names), first_line=first)
    if not stated and choice.rate is None:
        raise InputError(f"{file}: states no DataRate; give --rate in frames per second")
    keypoints = projected(file, names, places, unit, stated, choice, frame, ups="yz")
    _check_count(file, "NumFrames", about, len(data))
    return keypoints


def _check_count(file: Path, key: str, about: dict[str, str], rows: int) -> None:
    stated = number_or_none(about.get(key, ""))
    if stated is not None and rows < stated:
        raise InputError(f"{file}: states {key} {stated:g} and has {rows} rows; copy it again")


def _frames(file: Path, data: list[tuple[int, list[str]]]) -> Ints:
    """(T,) frame numbers of rows."""
    if len(data) < 2:
        raise InputError(f"{file}: holds {len(data)} frames; a motion needs at least 2")
    numbers = []
    for line, row in data:
        number = number_or_none(row[0].strip())
        if number is None:
            raise InputError(f"{file}: line {line}: expected a frame number, found {row[0]!r}")
        numbers.append(number)
    return frame_numbers(str(file), np.array(numbers))
