"""Motion-capture markers, projected onto a plane, of C3D and of QTM's TSV.

A TSV begins with lines of a name and its values (``FREQUENCY``, ``MARKER_NAMES``, ...). A line of
column names may follow, then rows of x, y, z per marker, mm. Some exports begin rows with frame and
time. The values 0, 0, 0 or an empty cell mean a missing marker.
"""

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.file_units import LENGTHS_M, named_unit, unit_m
from snakewalk.config.reading import Fact
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.console.separate_reader import read_separately
from snakewalk.controller.track.choice import FEWEST, PLANES, Choice
from snakewalk.controller.track.readers import c3d_file
from snakewalk.controller.track.readers.keypoints import Keypoints

_ACROSS = {"x": "yz", "y": "xz", "z": "xy"}
"""Plane across each axis."""
_FLAT_SHARE = 0.5
"""Least spread of markers over the next larger one, above which no axis is likely to point up
(ours)."""
_UNLABELLED_NAME = re.compile(
    r"\*\d*|uname\*?\d+|unlabell?ed[ _-]?\d*|unknown[ _-]?\d*|unnamed[ _-]?\d*|new \d{4}",
)
"""Names that programs give to markers without a label: ``*17``, ``uname*4``, ``New 0012``."""
_STILL_SHARE = 0.02
"""Part of the others' usual way in which a marker counts as one that does not move (ours)."""
_JOINED_DEVIATION = 0.1
_NEAR_SPACINGS = 3.0
"""Largest change of the distance to a neighbour on a body, and largest distance, in spacings of
markers (ours)."""
_FIRST_WORDS = {"NO_OF_FRAMES", "NO_OF_MARKERS", "FREQUENCY", "MARKER_NAMES", "DATA_INCLUDED"}


def is_qtm(head: bytes) -> bool:
    """Whether a file with this head is QTM's."""
    return head.removeprefix(b"\xef\xbb\xbf").split(b"\t", 1)[0].decode("latin-1") in _FIRST_WORDS


def load_qtm(file: Path, choice: Choice) -> Keypoints:
    """Load QTM's TSV; see ``load.load_file``."""
    # a row of empty cells is a frame in which no marker was seen
    lines = [row for row in read_rows(file, "TSV", "\t") if len(row) > 1 or any(row)]
    about: dict[str, list[str]] = {}
    while lines and lines[0][0].isupper() and not number_or_none(lines[0][0]):
        row = lines.pop(0)
        about[row[0].strip()] = [cell.strip() for cell in row[1:]]
    names = [name for name in about.get("MARKER_NAMES", []) if name]
    if about.get("DATA_INCLUDED", ["3D"])[0] != "3D" or not names:
        raise InputError(f"{file}: expected QTM's 3D data with MARKER_NAMES")
    before = 0
    if lines and not any(number_or_none(cell) for cell in lines[0]):
        titles = [cell.strip().lower() for cell in lines.pop(0)[:2]]  # of the columns
        before = len([title for title in titles if title in {"frame", "time"}])
    if not lines or min(map(len, lines)) < before + 3:
        raise InputError(f"{file}: expected rows of x, y, z of {len(names)} markers, in mm")
    places = marker_places(
        file, [row[before:] for row in lines], len(names), first_line=len(about) + 1 + bool(before)
    )
    stated = number_or_none((about.get("FREQUENCY") or [""])[0])
    return projected(file, names, places, "mm", stated, choice)


def load_c3d(file: Path, choice: Choice) -> Keypoints:
    """Load a C3D; see ``load.load_file``."""
    require_extra(f"{file}: C3D needs", "ezc3d")
    arrays, said = read_separately(file, c3d_file.__name__)
    places = arrays["places"]
    up = said["up"] if said["up"] in ("+x", "+y", "+z") else "z"
    names = said["names"][: places.shape[1]]
    return projected(file, names, places, said["unit"], said["rate_hz"] or None, choice, ups=up)


def marker_places(
    file: Path, rows: Sequence[Sequence[str]], markers: int, *, first_line: int
) -> Floats:
    """(T, K, 3) places from cells of x, y, z per marker; NaN where a marker was not seen.

    ``first_line`` is the rows' first line in the file.

    Raises:
        InputError: a cell is not a number.

    """
    names = [f"{axis} of marker {k + 1}" for k in range(markers) for axis in "xyz"]
    lines = range(first_line, first_line + len(rows))
    return numbers_of(file, rows, names, lines).reshape(-1, markers, 3)


def projected(
    file: Path,
    names: list[str],
    places: Floats,
    unit: str,
    rate_hz: float | None,
    choice: Choice,
    frame: Ints | None = None,
    ups: str = "z",
) -> Keypoints:
    """Markers (T, K, 3) projected onto a plane.

    ``ups`` is the axis that the file states to point up, ``+z``, or the usual ones of the format.
    Without chosen keypoints, unlabelled and static markers are left out, and named in the notes.
    """
    length = named_unit(unit)
    if length is None and unit.strip():
        raise InputError(f"{file}: its unit is {unit!r}; expected one of {', '.join(LENGTHS_M)}")
    places = np.where((places == 0.0).all(axis=2)[..., None], np.nan, places)
    notes: list[str] = []
    if choice.keypoints is None:
        kept, notes = _labelled_and_moving(names, places)
        if len(kept) < FEWEST and notes:
            raise InputError(
                f"{file}: {len(kept)} markers have a label and move, a body needs {FEWEST}; say "
                f"--keypoints with those of the midline, head first, of {', '.join(names)}"
            )
        names = [names[k] for k in kept]
        places = places[:, kept]
    plane = _plane(file, places, choice, ups)
    return Keypoints(
        file,
        names,
        places[..., list(PLANES[plane.value])] * [1.0, -1.0 if plane.value == "xz" else 1.0],
        None,
        rate_hz=rate_hz,
        frame=frame,
        scale_m=None if length is None else unit_m(length),
        facts={"plane": plane},
        notes=tuple(notes),
    )


def _plane(file: Path, places: Floats, choice: Choice, ups: str) -> Fact:
    """Plane of a body: by the user, by the axis that the file states as up, or by the spread.

    Raises:
        InputError: the file states no axis, and the spread of the markers is not that of a body
            on the ground.

    """
    if choice.plane is not None:
        return Fact(choice.plane, "user", "--plane")
    if ups.startswith("+"):
        return Fact(_ACROSS[ups[1]], "file", f"its axis {ups} points up")
    spread = np.nan_to_num(np.nanstd(places, axis=(0, 1)))
    order = np.argsort(spread, kind="stable")
    flat = "xyz"[order[0]]
    if flat in ups and spread[order[0]] <= _FLAT_SHARE * spread[order[1]]:
        return Fact(_ACROSS[flat], "inferred", f"no axis is stated to point up; flat along {flat}")
    listed = ", ".join(f"{size:.3g} along {axis}" for axis, size in zip("xyz", spread, strict=True))
    raise InputError(
        f"{file}: does not state which axis points up, and its markers spread by {listed}; give "
        "--plane xy if z points up, xz if y does, yz if x does"
    )


def _labelled_and_moving(names: Sequence[str], places: Floats) -> tuple[list[int], list[str]]:
    """Labelled markers that move, and a line about each kind of the others."""
    every = range(len(names))
    without = [k for k in every if is_unlabelled(names[k])]
    rest = [k for k in every if k not in without]
    labelled = [k for k in rest if np.isfinite(places[:, k]).any()]
    still = _still_markers(places, labelled)
    notes = []
    for left, why in ((without, "without a label"), (still, "that do not move")):
        if left:
            listed = ", ".join(names[k] or "(no name)" for k in left)
            notes.append(f"{len(left)} markers {why} are left out: {listed}; --keypoints uses them")
    return [k for k in rest if k not in still], notes


def _still_markers(places: Floats, candidates: Sequence[int]) -> list[int]:
    """Markers that neither move nor keep a distance to a moving one.

    A body's head may be held in place; the marker next to it then keeps its distance.
    """
    if len(candidates) < FEWEST:
        return []
    extent = np.nanmax(places, axis=0) - np.nanmin(places, axis=0)
    extent_m = np.linalg.norm(extent, axis=1)
    usual = float(np.median(extent_m[list(candidates)]))
    moving = [k for k in candidates if extent_m[k] >= _STILL_SHARE * usual]
    spacing = float(np.nanmedian(np.linalg.norm(np.diff(places[:, moving], axis=1), axis=2)))
    still_points = []
    for k in candidates:
        if k not in moving:
            gap = np.linalg.norm(places[:, moving] - places[:, k, None], axis=2)
            near = np.nanmean(gap, axis=0) < _NEAR_SPACINGS * spacing
            if not (near & (np.nanstd(gap, axis=0) < _JOINED_DEVIATION * spacing)).any():
                still_points.append(k)
    return still_points


def is_unlabelled(name: str) -> bool:
    """Whether a program generated this name for a marker without a label."""
    return not name.strip() or _UNLABELLED_NAME.fullmatch(name.strip().lower()) is not None


def number_or_none(text: str) -> float | None:
    """The finite number in a text, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
