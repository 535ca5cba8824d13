"""Units of length in files, in metres: by name, and in coordinate systems."""

import math
import re
from collections.abc import Sequence
from typing import Any, Final

from snakewalk.config.errors import InputError

FOOT_M = 0.3048
US_FOOT_M = 1200.0 / 3937.0
UNITS_M = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "km": 1000.0,
    "ft": FOOT_M,
    "us-ft": US_FOOT_M,
}
"""Metres per unit of length, by the names that options accept."""
DEGREE: Final = "deg"
UNSTATED_UNIT = "the file states no unit of lengths: metres; --unit states another"
UNSTATED_HEIGHTS = "the file states no unit of heights: metres"
_SPELLINGS = {
    "m": ("m", "metre", "meter", "metres", "meters"),
    "cm": ("cm", "centimetre", "centimeter", "centimetres", "centimeters"),
    "mm": ("mm", "millimetre", "millimeter", "millimetres", "millimeters"),
    "km": ("km", "kilometre", "kilometer", "kilometres", "kilometers"),
    "ft": ("ft", "foot", "feet", "international foot", "international feet", "foot international"),
    "us-ft": (
        "us-ft",
        "us survey foot",
        "us survey feet",
        "foot us",
        "ftus",
        "us foot",
        "sft",
        "foot us survey",
        "survey foot",
        "u s survey foot",
        "us survey ft",
        "usft",
    ),
}
VERTICAL_PART = re.compile(r"\b(?:VERT_CS|VERTCRS|VERTICALCRS)\[")
WKT_UNIT = re.compile(r'\b(?:LENGTHUNIT|UNIT)\["([^"]*)",\s*([-+0-9.eE]+)')
_TRUE_SCALE_TOLERANCE = 0.005
"""Share by which a map's lengths may be off before true lengths are used (ours): UTM is within."""
_MOST_VARIATION = 0.1
"""Change of a map's scale over a file that is accepted (ours)."""


def named_unit(words: str) -> str | None:
    """Name in ``UNITS_M`` of a unit as spelled in files, or None."""
    plain = re.sub(r"[^a-z0-9-]+", " ", words.lower()).strip()
    return next((name for name, spellings in _SPELLINGS.items() if plain in spellings), None)


def unit_name(factor_m: float) -> str:
    """Name of a unit by its length in metres, or that length as a number."""
    for name, length_m in UNITS_M.items():
        if math.isclose(length_m, factor_m, rel_tol=1e-8):
            return name
    return repr(float(factor_m))


def unit_m(unit: str) -> float:
    """Metres per unit of length, by name or as a number."""
    return UNITS_M[unit] if unit in UNITS_M else float(unit)


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
    from rasterio import errors, warp  # noqa: PLC0415  an extra

    (x, y), (dx, dy) = place, step
    at_x, at_y = [x - dx, x + dx, x, x], [y, y, y - dy, y + dy]
    try:
        longitude, latitude = warp.transform(crs, "EPSG:4326", at_x, at_y)
    except (errors.RasterioError, ValueError):
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
        math.isnan(middle[0])
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
