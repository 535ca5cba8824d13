"""LAS and LAZ: points of laser scanners, read in chunks by laspy."""

import logging
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_head
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.file_units import DEGREE, unit_m, unit_name
from snakewalk.config.reading import Facts, by_file, by_user, decided
from snakewalk.controller.console.separate_reader import read_separately
from snakewalk.controller.mapping.length_units import (
    SYSTEM,
    VERTICAL_PART,
    WKT_UNIT,
    degree_cell_m,
    ground_lengths,
    height_fact,
    vertical_unit,
)
from snakewalk.controller.mapping.raster_file import Crop

MOST_POINTS = 10_000_000
"""Points that are kept at once (ours): 240 MB, and some copies."""
_MOST_READ = 2_000_000_000
_CHUNK = 1_000_000
_GROUND = (2, 8)
"""Classes of the ground: ground, model key points (ASPRS LAS 1.4, tables 8 and 17)."""
_NOISE = (7, 18)
"""Low and high noise."""
_NAMES = {
    0: "never classified",
    1: "unclassified",
    2: "ground",
    3: "low vegetation",
    4: "medium vegetation",
    5: "high vegetation",
    6: "building",
    7: "low noise",
    8: "model key point",
    9: "water",
    10: "rail",
    11: "road",
    17: "bridge",
    18: "high noise",
}
_MODEL_TYPE, _GEOGRAPHIC_TYPE, _PROJECTED_TYPE = 1024, 2048, 3072
_LINEAR_UNITS, _VERTICAL_UNITS = 3076, 4099
"""Keys of GeoTIFF, as records 34735 have them."""
_USER_DEFINED = 32767
_WKT_RECORD = 2112
_PROJECTED_PART = re.compile(r"\b(?:PROJCS|PROJCRS|PROJECTEDCRS)\[")
_KEY_UNITS = {9001: "m", 9002: "ft", 9003: "us-ft"}


@dataclass(frozen=True, slots=True)
class LasPoints:
    """Points of a file, in its units, with its statements."""

    points: Floats
    """(n, 3) x, y, z."""
    unit: str | None
    """Unit of x and y: of ``LENGTHS_M`` or deg; None: not stated."""
    height_unit: str | None
    """Unit of z; None: not stated."""
    crs: Any = None
    """Projected coordinate system of Rasterio; None: not stated, or unknown."""
    notes: list[str] = field(default_factory=list)
    cropped: bool = False
    """Whether the crop was cut already."""


def read_las(
    file: Path,
    classes: Collection[int] | None,
    crop: Crop | None = None,
    unit: str | None = None,
) -> LasPoints:
    """Read the points of the ground, or of some classes.

    The LAZ decoder ends its process on some damaged files, so it has a separate process with
    limited memory and time.

    Args:
        file: ends in .las or .laz.
        classes: to keep; None: ground if the file has some, else all but noise.
        crop: in metres from the south-west corner; ignored for a file in degrees.
        unit: of x and y by the user, for the crop.

    Raises:
        InputError: it is damaged, or has too many points.
        OSError: the file cannot be opened.

    """
    require_extra("LAS and LAZ need", "laspy", "lazrs")
    read_head(file, 1)
    chosen = None if classes is None else sorted(classes)
    arrays, said = read_separately(file, __name__, chosen, crop, unit)
    system = said["system"]
    return LasPoints(
        arrays["points"],
        said["unit"],
        said["height_unit"],
        None if system is None else _system(system),
        said["notes"],
        said["cropped"],
    )


def child(
    file: str, classes: Collection[int] | None, crop: Crop | None, unit: str | None
) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Points of a file, and its statements; the work of the separate process."""
    import laspy  # noqa: PLC0415  an extra

    logging.getLogger("laspy").setLevel(logging.CRITICAL)  # the fault has its messages
    with laspy.open(file) as reader:
        stated, height_unit, system = _units(reader.header)
        plane = unit or stated
        window = None
        if crop is not None and plane not in (None, DEGREE):
            window = [crop_value / unit_m(plane) for crop_value in crop]
        points, notes = _read(reader, classes, window)
    return {"points": points}, {
        "unit": stated,
        "height_unit": height_unit,
        "system": system,
        "notes": notes,
        "cropped": window is not None,
    }


def _read(
    reader: Any, classes: Collection[int] | None, window: Sequence[float] | None
) -> tuple[Floats, list[str]]:
    header = reader.header
    count = int(header.point_count)
    if count > _MOST_READ:
        raise InputError(f"states {count} points; the most is {_MOST_READ}")
    corner = np.asarray(header.mins[:2], dtype=float)
    low, high = (
        (np.full(2, -np.inf), np.full(2, np.inf))
        if window is None
        else (corner + np.array(window[:2]), corner + np.array(window[2:]))
    )
    counts_by_class: dict[int, int] = {}
    withheld_count = 0
    kept = []
    total = 0
    kept_count = 0
    ground: list[Floats] = []
    for chunk in reader.chunk_iterator(_CHUNK):
        points = np.stack([np.asarray(getattr(chunk, axis), float) for axis in "xyz"], axis=-1)
        kinds = np.asarray(chunk.classification)
        kept_count += len(points)
        held_back = np.asarray(chunk.withheld, dtype=bool)
        withheld_count += int(held_back.sum())
        inside = ~held_back & ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)
        for kind, number in zip(*np.unique(kinds[inside], return_counts=True), strict=True):
            counts_by_class[int(kind)] = counts_by_class.get(int(kind), 0) + int(number)
        is_kept = ~np.isin(kinds, _NOISE) if classes is None else np.isin(kinds, list(classes))
        is_ground = np.isin(kinds, _GROUND) if classes is None else is_kept
        if not ground:
            kept.append(points[inside & is_kept])
        ground_part = points[inside & is_ground]
        if len(ground_part) and classes is None:
            ground.append(ground_part)
            kept = []
        total = sum(map(len, kept)) + sum(map(len, ground))
        if total > MOST_POINTS:
            raise InputError(f"over {MOST_POINTS} points are left of {count}: --crop a part")
    chosen = ground or kept
    points = np.concatenate(chosen) if chosen else np.empty((0, 3))
    if kept_count < count:
        raise InputError(f"states {count} points, and holds {kept_count}")
    notes = _class_notes(counts_by_class, classes, bool(ground), len(points))
    if withheld_count:
        notes.append(f"{withheld_count} withheld points are left out")
    return points, notes


def _class_notes(
    counts_by_class: dict[int, int], classes: Collection[int] | None, by_ground: bool, kept: int
) -> list[str]:
    used = (
        set(classes)
        if classes is not None
        else set(_GROUND if by_ground else (kind for kind in counts_by_class if kind not in _NOISE))
    )
    dropped = {kind: number for kind, number in counts_by_class.items() if kind not in used}
    notes = [f"{kept} points of {sum(counts_by_class.values())} are used"]
    if classes is None:
        notes[0] += ": those of the ground" if by_ground else ": no class is ground"
    if dropped:
        words = ", ".join(
            f"{number} of class {kind} ({_NAMES.get(kind, 'other')})"
            for kind, number in sorted(dropped.items())
        )
        notes.append(f"left out: {words}; --classes chooses")
    return notes


def _units(header: Any) -> tuple[str | None, str | None, str | int | None]:
    wkt = ""
    keys = {}
    for record in [*header.vlrs, *(header.evlrs or [])]:
        text = getattr(record, "string", None)
        if isinstance(text, str) and record.record_id == _WKT_RECORD:
            wkt = text.rstrip("\0")
        for key in getattr(record, "geo_keys", ()):
            if key.tiff_tag_location == 0:
                keys[int(key.id)] = int(key.value_offset)
    if wkt:
        plain = VERTICAL_PART.split(wkt)[0]
        if _PROJECTED_PART.search(plain) is None:
            return DEGREE, vertical_unit(wkt), None
        units = WKT_UNIT.findall(plain)
        unit = unit_name(float(units[-1][1])) if units else None
        return unit, vertical_unit(wkt), wkt
    vertical = _KEY_UNITS.get(keys.get(_VERTICAL_UNITS, 0))
    number = keys.get(_PROJECTED_TYPE, 0)
    if keys.get(_MODEL_TYPE) == 2 or (_GEOGRAPHIC_TYPE in keys and not number):
        return DEGREE, vertical, None
    unit = _KEY_UNITS.get(keys.get(_LINEAR_UNITS, 0))
    if not number or number == _USER_DEFINED:
        return unit, vertical, None
    system = _system(number)
    if unit is None and system is not None:
        unit = unit_name(float(system.linear_units_factor[1]))
    return unit, vertical, number


def _system(text_or_number: str | int) -> Any:
    try:
        from rasterio.crs import CRS  # noqa: PLC0415  an extra

        if isinstance(text_or_number, int):
            return CRS.from_epsg(text_or_number)
        return CRS.from_wkt(text_or_number)
    except Exception:  # its unit is stated or requested anyway
        return None


def in_metres(
    file: Path, las_points: LasPoints, unit: str | None, height_unit: str | None
) -> tuple[Floats, Facts, list[str]]:
    """Points in metres, their units, and notes.

    Raises:
        InputError: the unit is unknown (the question).

    """
    given = by_user("--unit", unit) or by_file(SYSTEM, las_points.unit)
    readings = {"m": "metres", "ft": "feet", "us-ft": "US survey feet", DEGREE: "degrees"}
    fact = decided(file, "states no coordinate system, and so no unit", "--unit", readings, given)
    plane = fact.value
    height = height_fact(file, fact, height_unit, by_file(SYSTEM, las_points.height_unit))
    notes: list[str] = []
    up = height.value
    facts = {"unit": fact, "height_unit": height}
    points = las_points.points
    if plane == DEGREE:
        middle = float(np.median(points[:, 1])) if len(points) else 0.0
        east_m, north_m = degree_cell_m(1.0, 1.0, middle)
        return points * [east_m, north_m, unit_m(up)], facts, notes
    x_m = y_m = unit_m(plane)
    if las_points.crs is not None and unit is None and len(points):
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        middle = 0.5 * (low + high)
        half = np.maximum(0.5 * (high - low), 1.0)
        corners = [tuple(middle + half * side) for side in ((0, 0), (0, -1), (0, 1), (1, 0))]
        try:
            x_m, y_m, words = ground_lengths(las_points.crs, x_m, corners, (1.0, 1.0))
        except InputError as error:
            raise InputError(f"{file}: {error}") from None
        notes += words
    return points * [x_m, y_m, unit_m(up)], facts, notes
