"""Lengths on the ground: units of coordinate systems, degrees and projections."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.config.file_units import DEGREE, unit_name
from snakewalk.config.reading import Fact, by_user, decided

UNSTATED_UNIT = "the file states no unit of lengths: metres; --unit states another"
UNSTATED_HEIGHTS = "the file states no unit of heights: metres"
SYSTEM = "its coordinate system"
VERTICAL_PART = re.compile(r"\b(?:VERT_CS|VERTCRS|VERTICALCRS)\[")
WKT_UNIT = re.compile(r'\b(?:LENGTHUNIT|UNIT)\["([^"]*)",\s*([-+0-9.eE]+)')
_TRUE_SCALE_TOLERANCE = 0.005
"""Share by which a map's lengths may be off before true lengths are used (ours): UTM is within."""
_MOST_VARIATION = 0.1
"""Change of a map's scale over a file that is accepted (ours)."""


def vertical_unit(wkt: str) -> str | None:
    """Unit of heights of a compound coordinate system in WKT, or None."""
    match = VERTICAL_PART.search(wkt)
    if match is None:
        return None
    depth = 1
    end = match.end()
    while end < len(wkt) and depth:
        depth += {"[": 1, "]": -1}.get(wkt[end], 0)
        end += 1
    unit = WKT_UNIT.search(wkt[match.end() : end])
    return None if unit is None else unit_name(float(unit[2]))


def height_fact(file: Path, unit: Fact, answer: str | None, in_file: Fact | None) -> Fact:
    """Unit of heights: by the user, the file, or the user's unit of lengths.

    Raises:
        InputError: only the unit of lengths is stated, and it is not metric (the question).

    """
    fact = by_user("--height-unit", answer) or in_file
    if fact is None and unit.source == "user" and unit.value != DEGREE:
        fact = unit
    elif fact is None and unit.value in (DEGREE, "m"):
        fact = Fact("m", "inferred", UNSTATED_HEIGHTS)
    question = f"its x and y are in {unit.value}, and it states no unit of heights; they are in"
    readings = {unit.value: unit.value, "m": "metres"}
    return decided(file, question, "--height-unit", readings, fact)


def degree_cell_m(dx: float, dy: float, latitude: float) -> tuple[float, float]:
    """Metres of degrees of longitude and latitude, on WGS 84."""
    a_m = 6378137.0
    e2 = 0.00669437999014
    angle = math.radians(latitude)
    w = 1.0 - e2 * math.sin(angle) ** 2
    north = a_m * (1.0 - e2) / w**1.5
    return math.radians(dx) * a_m / math.sqrt(w) * math.cos(angle), math.radians(dy) * north


def true_scale(
    crs: Any, place: tuple[float, float], step: tuple[float, float]
) -> tuple[float, float]:
    """Metres on the ground per unit of a projected system, in x and y at a place.

    ``crs`` is Rasterio's; ``step`` of x and y is measured.

    Returns:
        NaN twice if the place is not on the earth.

    """
    from rasterio import warp  # noqa: PLC0415  an extra

    (x, y), (dx, dy) = place, step
    at_x, at_y = [x - dx, x + dx, x, x], [y, y, y - dy, y + dy]
    try:
        longitude, latitude = warp.transform(crs, "EPSG:4326", at_x, at_y)
    except Exception:  # the errors of PROJ have no public base
        return math.nan, math.nan
    if not all(map(math.isfinite, [*longitude, *latitude])):
        return math.nan, math.nan
    scales = []
    for first, last, width in ((0, 1, dx), (2, 3, dy)):
        turn = (longitude[last] - longitude[first] + 180.0) % 360.0 - 180.0
        middle = 0.5 * (latitude[first] + latitude[last])
        east_m, north_m = degree_cell_m(turn, latitude[last] - latitude[first], middle)
        scales.append(math.hypot(east_m, north_m) / (2.0 * width))
    return scales[0], scales[1]


def ground_lengths(
    crs: Any, per_unit_m: float, places: Sequence[tuple[float, float]], step: tuple[float, float]
) -> tuple[float, float, list[str]]:
    """Metres on the ground per unit of a projected system in x and y, with notes.

    Args:
        crs: a coordinate system of Rasterio.
        per_unit_m: nominal metres per unit.
        places: the middle, then others to compare the scale with.
        step: of x and y that is measured.

    Raises:
        InputError: the scale changes too much over the places.

    """
    middle = true_scale(crs, places[0], step)
    if (
        not min(middle) > 0.0
        or max(abs(length / per_unit_m - 1.0) for length in middle) <= _TRUE_SCALE_TOLERANCE
    ):
        return per_unit_m, per_unit_m, []
    notes = [
        f"the projection has no true lengths: 1 m of it is {middle[0] / per_unit_m:.4g} m west to "
        f"east and {middle[1] / per_unit_m:.4g} m south to north on the ground at the middle; true "
        "lengths are used"
    ]
    others = [true_scale(crs, place, step) for place in places[1:]]
    change = max(
        (
            abs(other[k] / middle[k] - 1.0)
            for other in others
            for k in (0, 1)
            if not math.isnan(other[k])
        ),
        default=0.0,
    )
    if change > _MOST_VARIATION:
        raise InputError(
            f"its projection's scale changes by {100.0 * change:.0f} % over the part that is read; "
            "--crop a smaller part"
        )
    if change > 0.01:
        notes.append(f"the projection's scale changes by {100.0 * change:.1f} % over the part")
    return middle[0], middle[1], notes
