"""Markers in space, as motion capture has them, projected onto a plane: QTM's TSV, and C3D.

A TSV begins with lines of a name and its values (``FREQUENCY``, ``MARKER_NAMES``, ...), a line of
column names may follow, then rows of x, y, z of each marker, mm; some exports begin rows with frame
and time. 0, 0, 0 and nothing are missing. C3D is read by ezc3d.
"""

import csv
import math
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.track.readers.keypoints import PLANES, Choice, Keypoints

_UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
_FIRST_WORDS = {"NO_OF_FRAMES", "NO_OF_MARKERS", "FREQUENCY", "MARKER_NAMES", "DATA_INCLUDED"}


def is_qtm(head: bytes) -> bool:
    """Whether a file that begins so is one of QTM's."""
    return head.removeprefix(b"\xef\xbb\xbf").split(b"\t", 1)[0].decode("latin-1") in _FIRST_WORDS


def load_qtm(file: Path, rate_hz: float | None, choice: Choice) -> Keypoints:
    """Load QTM's TSV of marker trajectories; see ``load.load_file``."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            lines = [row for row in csv.reader(stream, delimiter="\t") if any(row)]
    except (UnicodeDecodeError, csv.Error):
        raise InputError(f"{file}: is no TSV in UTF-8") from None
    about: dict[str, list[str]] = {}
    while lines and lines[0][0].isupper() and not _number(lines[0][0]):
        row = lines.pop(0)
        about[row[0].strip()] = [cell.strip() for cell in row[1:]]
    names = [name for name in about.get("MARKER_NAMES", []) if name]
    if about.get("DATA_INCLUDED", ["3D"])[0] != "3D" or not names:
        raise InputError(f"{file}: expected QTM's 3D data with MARKER_NAMES")
    before = 0
    if lines and not any(_number(cell) for cell in lines[0]):
        titles = [cell.strip().lower() for cell in lines.pop(0)[:2]]  # of the columns
        before = len([one for one in titles if one in {"frame", "time"}])
    if not lines or min(map(len, lines)) < before + 3:
        raise InputError(f"{file}: expected rows of x, y, z of {len(names)} markers, in mm")
    places = np.full((len(lines), len(names), 3), np.nan)
    for k, row in enumerate(lines):
        for n, cell in enumerate(row[before : before + 3 * len(names)]):
            text = cell.strip()
            if text and text.lower() not in {"nan", "null"}:
                value = _number(text)
                if value is None:
                    raise InputError(f"{file}: row {k + 1}: expected a number, found {text!r}")
                places[k, n // 3, n % 3] = value
    stated = _number((about.get("FREQUENCY") or [""])[0])
    return _projected(file, names, places, 1e-3, stated if rate_hz is None else rate_hz, choice)


def load_c3d(file: Path, rate_hz: float | None, choice: Choice) -> Keypoints:
    """Load the markers of a C3D; see ``load.load_file``."""
    require_extra(f"{file}: C3D needs", "ezc3d")
    import ezc3d  # noqa: PLC0415  an extra

    try:
        held = ezc3d.c3d(str(file))
        about = held["parameters"]["POINT"]
        names = [str(name) for name in about["LABELS"]["value"]]
        unit = str((about["UNITS"]["value"] or ["mm"])[0]).strip()
        stated = float(about["RATE"]["value"][0])
        places = np.asarray(held["data"]["points"], dtype=float)[:3].transpose(2, 1, 0)
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{file}: is no C3D that can be read: {reason}") from None
    if unit not in _UNITS:
        raise InputError(f"{file}: its unit is {unit!r}; expected one of {', '.join(_UNITS)}")
    return _projected(
        file, names[: places.shape[1]], places, _UNITS[unit], rate_hz or stated or None, choice
    )


def _projected(
    file: Path,
    names: list[str],
    places: Floats,
    scale_m: float,
    rate_hz: float | None,
    choice: Choice,
) -> Keypoints:
    """Markers (T, K, 3) seen at right angles to a plane."""
    plane = choice.plane or "xy"
    if plane not in PLANES:
        raise InputError(f"{file}: --plane {plane}: expected one of {', '.join(PLANES)}")
    places = np.where((places == 0.0).all(axis=2)[..., None], np.nan, places)
    return Keypoints(
        file,
        names,
        places[..., list(PLANES[plane])],
        None,
        rate_hz=rate_hz,
        scale_m=scale_m,
    )


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
