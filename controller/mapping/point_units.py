"""Points of a file in metres: their unit is stated by the user or column names, or asked for."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from snakewalk.config.archive import ending
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.file_units import DEGREE, named_unit, unit_m
from snakewalk.config.reading import Fact, Facts, by_names, decided, stated
from snakewalk.config.table_columns import preview
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.length_units import UNSTATED_UNIT, degree_cell_m, height_fact

_AXES = {
    **dict.fromkeys(("x", "east", "easting", "lon", "lng", "long", "longitude"), 0),
    **dict.fromkeys(("y", "north", "northing", "lat", "latitude"), 1),
    **dict.fromkeys(("z", "height", "elevation", "alt", "altitude"), 2),
}
_NAME = re.compile(r"([a-z]+)(?:[ _]?[\[(_ ]([a-z-]+)[\])]?)?")
"""Name of an axis, and its unit."""
_MOST_DEGREES = 1.0
"""Larger ground is not a ground for a robot (ours)."""
_FAR_EXTENTS = 20.0
"""Points that are this many times their extent from the origin may be places on earth (ours)."""


def points_in_metres(
    file: Path, points: Floats, names: Sequence[str], units: ElevationChoice
) -> tuple[Floats, Facts]:
    """Return points (n, 3) in metres, and their units; degrees become metres east and north.

    Args:
        file: for errors.
        points: as in the file.
        names: of its columns, or none.
        units: stated by the user.

    Raises:
        InputError: the points may be degrees (the question), or a point has too few numbers.

    """
    layout = _layout(names)
    if layout is None and (units.columns or points.shape[1] != 3):
        question = (
            f"{file}: has {points.shape[1]} columns, {', '.join(names) or 'without names'}; add "
            "--columns x=COLUMN, y=COLUMN and z=COLUMN"
        )
        raise InputError([question, *preview(points[:4].astype(str).tolist())])
    order, unit_named, height_named = layout or ([0, 1, 2], None, None)
    given, height_given = (
        by_names(value, names, units.columns) for value in (unit_named, height_named)
    )
    points = points[:, order]
    if units.no_data is not None:
        points = np.where(points == units.no_data, np.nan, points)
    fact = stated(file, "--unit", given, units.unit)
    if fact is None and ending(file) == ".glb":
        fact = Fact("m", "file", "its format")
    if fact is None:
        fact = _unstated(file, points)
    unit = fact.value
    if fact.source == "file" and unit == "m":
        height_given = height_given or fact
    height = height_fact(file, fact, units.height_unit, height_given)
    facts = {"unit": fact, "height_unit": height}
    rise_m = unit_m(height.value)
    if unit != DEGREE:
        return points * [unit_m(unit), unit_m(unit), rise_m], facts
    if not _is_on_earth(points):
        raise InputError(f"{file}: --unit deg: expected longitude, latitude and height in columns")
    return points * [*degree_cell_m(1.0, 1.0, _latitude(points)), rise_m], facts


def _layout(names: Sequence[str]) -> tuple[list[int], str | None, str | None] | None:
    """Columns of x, y, z, and units of x and of z; None if names do not state the columns."""
    matches = [_NAME.fullmatch(name.lower().strip(" \"'/")) for name in names]
    axes = [None if match is None else _AXES.get(match[1]) for match in matches]
    if len(axes) == 3 and axes.count(None) == 1 and {0, 1} <= {*axes}:
        axes[axes.index(None)] = 2
    if any(axes.count(axis) != 1 for axis in range(3)):
        return None
    order = [axes.index(axis) for axis in range(3)]
    units = [named_unit(match[2] or "") if (match := matches[k]) else None for k in order]
    first = names[order[0]].lower().strip(" \"'/")
    return order, DEGREE if first.startswith(("lon", "lng")) else units[0], units[2]


def _latitude(points: Floats) -> float:
    return float(np.nanmedian(points[:, 1]))


def _is_on_earth(points: Floats) -> bool:
    size = np.nanmax(np.abs(points[:, :2]), axis=0, initial=0.0)
    return bool(size[0] <= 360.0 and size[1] <= 90.0)


def _unstated(file: Path, points: Floats) -> Fact:
    """Metres; or the question, if the points may be degrees: small, and far from the origin."""
    metres = Fact("m", "inferred", UNSTATED_UNIT)
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) < 2 or not _is_on_earth(finite):
        return metres
    extent = np.ptp(finite[:, :2], axis=0)
    distance = np.abs(finite[:, :2].mean(axis=0)).max()
    if extent.max() > _MOST_DEGREES or distance < _FAR_EXTENTS * extent.max():
        return metres
    east_m, north_m = degree_cell_m(float(extent[0]), float(extent[1]), _latitude(finite))
    readings = {
        DEGREE: f"degrees, a ground of {east_m:.4g} m by {north_m:.4g} m",
        "m": f"metres, one of {extent[0]:.4g} m by {extent[1]:.4g} m",
    }
    return decided(file, "states no unit of x and y", "--unit", readings, None)
