"""Raster files of heights: GeoTIFF and ASCII grid, pictures, tables and arrays of numbers.

Rows are stored from the north, as elevation models and pictures are; in a ``Raster`` y grows.
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from snakewalk.config.archive import check_expansion, read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra

GEO_RASTERS: Final = (".tif", ".tiff", ".asc")
RASTERS: Final = (*GEO_RASTERS, ".png", ".csv", ".npz")
MOST_CELLS: Final = 40_000_000
"""Of a raster that is read (ours): 320 MB as numbers."""
UNITS_M: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048}
"""Metres per unit of length."""
DEGREE: Final = "deg"
Crop = tuple[float, float, float, float]
"""Least x and y, greatest x and y, in metres from the south-west corner of what the file holds."""


@dataclass(frozen=True, slots=True)
class Raster:
    """Heights on a grid of rectangular cells."""

    z_m: Floats
    """(rows, columns), row 0 in the south; NaN where the file has no data."""
    dx_m: float
    """Between columns."""
    dy_m: float
    """Between rows."""


@dataclass(frozen=True, slots=True)
class RasterUnits:
    """What a file may leave unsaid of its numbers."""

    unit: str | None = None
    """Of lengths: of ``UNITS_M``, or deg (then heights are metres); None: as the file says, or
    metres."""
    cell: float | None = None
    """Distance between samples, in the unit; None: as the file says."""
    height_step: float | None = None
    """Height of a step of one of the file's values, in the unit; needed of pictures."""
    no_data: float | None = None
    """Value of cells that hold nothing, beside what the file itself says of them."""


def read_raster(file: Path, units: RasterUnits, crop: Crop | None) -> Raster:
    """Read a raster, or the part of it within a crop.

    Raises:
        InputError: it cannot be read, is no raster of heights, is too large, says nothing of the
            size of its cells where ``units`` does not either, or has no cell within the crop.
        OSError: the file cannot be opened.

    """
    ending = file.suffix.lower()
    if ending in GEO_RASTERS:
        return _geo_raster(file, units, crop)
    values = {".png": _picture, ".csv": read_numbers, ".npz": _array}[ending](file)
    if ending == ".png" and units.height_step is None:
        raise InputError(f"{file}: a picture says no heights: --height-step, of one grey level")
    if units.cell is None:
        raise InputError(f"{file}: says no size of its cells: --cell, between two samples")
    if units.unit == DEGREE:
        raise InputError(f"{file}: says no latitude, so that degrees are no lengths: --unit m")
    cell_m = units.cell * _unit_m(units.unit)
    rows, columns = _window(file, values.shape, cell_m, cell_m, crop)
    z = _heights(values[rows, columns], units, None) * _unit_m(units.unit)
    return Raster(np.ascontiguousarray(z[::-1]), cell_m, cell_m)


def _geo_raster(file: Path, units: RasterUnits, crop: Crop | None) -> Raster:
    require_extra("GeoTIFF and ASCII grid need", "rasterio")
    import rasterio  # noqa: PLC0415  an extra
    from rasterio.errors import RasterioError  # noqa: PLC0415
    from rasterio.windows import Window  # noqa: PLC0415

    driver = "AAIGrid" if file.suffix.lower() == ".asc" else "GTiff"
    with file.open("rb"):  # a fault of the system is told as such
        pass
    try:
        with rasterio.open(file.absolute(), driver=driver) as held:
            if held.count != 1 and held.dtypes[0] == "uint8":
                raise InputError(
                    f"{file}: is a picture of {held.count} bands, and holds no heights"
                )
            turn = held.transform
            if not (math.isclose(turn.b, 0.0) and math.isclose(turn.d, 0.0)):
                raise InputError(f"{file}: its rows do not run west to east: warp it north up")
            has_cells = not (turn.is_identity and held.crs is None)
            if units.cell is None and not has_cells:
                raise InputError(f"{file}: says no size of its cells: --cell, between two samples")
            dx, dy = (abs(turn.a), abs(turn.e)) if units.cell is None else (units.cell,) * 2
            middle = turn.f + 0.5 * turn.e * held.height
            unit = units.unit or _unit_of(held.crs)
            dx_m, dy_m = _cell_m(file, dx, dy, unit, middle)
            rows, columns = _window(file, held.shape, dx_m, dy_m, crop, turn.e < 0.0)
            part = Window.from_slices(rows, columns)
            values = held.read(1, window=part, out_dtype="float64")
            absent = held.read_masks(1, window=part) == 0
    except (RasterioError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as {driver}: {error}") from None
    per_unit = 1.0 if unit == DEGREE else units_m_of(unit)
    z = _heights(values, units, absent) * per_unit
    return Raster(np.ascontiguousarray(z[::-1] if turn.e < 0.0 else z), dx_m, dy_m)


def units_m_of(unit: str) -> float:
    """Metres per unit of length, by name or as a number."""
    return UNITS_M[unit] if unit in UNITS_M else float(unit)


def _unit_of(crs: Any) -> str:
    """Unit of a coordinate system: degrees, metres, or its size in metres."""
    if crs is None:
        return "m"
    return DEGREE if crs.is_geographic else repr(float(crs.linear_units_factor[1]))


def _unit_m(unit: str | None) -> float:
    return 1.0 if unit is None else UNITS_M[unit]


def _cell_m(file: Path, dx: float, dy: float, unit: str, latitude: float) -> tuple[float, float]:
    """Cell in metres; of degrees by the ellipsoid WGS 84 at the raster's middle."""
    if unit != DEGREE:
        return dx * units_m_of(unit), dy * units_m_of(unit)
    if not -89.0 <= latitude <= 89.0:
        raise InputError(f"{file}: its middle has no latitude between -89 and 89: --unit m")
    a_m, e2, angle = 6378137.0, 0.00669437999014, math.radians(latitude)
    w = 1.0 - e2 * math.sin(angle) ** 2
    north = a_m * (1.0 - e2) / w**1.5
    return math.radians(dx) * a_m / math.sqrt(w) * math.cos(angle), math.radians(dy) * north


def _window(
    file: Path,
    shape: tuple[int, int],
    dx_m: float,
    dy_m: float,
    crop: Crop | None,
    from_north: bool = True,
) -> tuple[slice, slice]:
    """Rows and columns of a file that lie within a crop."""
    rows, columns = shape
    if not (np.isfinite([dx_m, dy_m]).all() and min(dx_m, dy_m) > 0.0):
        raise InputError(f"{file}: its cells are {dx_m:g} m by {dy_m:g} m")
    x0, y0, x1, y1 = crop or (0.0, 0.0, math.inf, math.inf)
    left, right = _span(x0, x1, dx_m, columns)
    bottom, top = _span(y0, y1, dy_m, rows)
    if right - left < 2 or top - bottom < 2:
        raise InputError(
            f"{file}: fewer than 2 by 2 cells are within the crop: the file holds "
            f"{columns * dx_m:.6g} m by {rows * dy_m:.6g} m, cells of {dx_m:.4g} m by {dy_m:.4g} m"
        )
    if (right - left) * (top - bottom) > MOST_CELLS:
        raise InputError(
            f"{file}: {right - left} by {top - bottom} cells are over {MOST_CELLS}: --crop a part "
            f"of its {columns * dx_m:.6g} m by {rows * dy_m:.6g} m"
        )
    down = slice(rows - top, rows - bottom) if from_north else slice(bottom, top)
    return down, slice(left, right)


def _span(low_m: float, high_m: float, step_m: float, count: int) -> tuple[int, int]:
    """First and one past the last cell whose middle lies within a span."""
    first = max(0, math.ceil(low_m / step_m - 0.5 - 1e-9))
    last = count if math.isinf(high_m) else math.floor(high_m / step_m - 0.5 + 1e-9) + 1
    return first, min(count, last)


def _heights(values: Floats, units: RasterUnits, absent: Any) -> Floats:
    """Values times their step; NaN where there are none."""
    z = np.array(values, dtype=float)
    if absent is not None:
        z[absent] = np.nan
    if units.no_data is not None:
        z[values == units.no_data] = np.nan
    z[~np.isfinite(z)] = np.nan
    return z if units.height_step is None else z * units.height_step


def _picture(file: Path) -> Floats:
    """Grey levels (rows, columns) of a picture of 8 or 16 bit."""
    require_extra("pictures need", "cv2")
    import cv2  # noqa: PLC0415  an extra

    data = file.read_bytes()
    if len(data) < 33 or data[:8] != b"\x89PNG\r\n\x1a\n":
        raise InputError(f"{file}: is no PNG")
    columns, rows, bits, colour = struct.unpack(">IIBB", data[16:26])
    if colour not in (0, 3):
        raise InputError(f"{file}: is a picture in colours; heights are grey, of 8 or 16 bit")
    check_expansion(file, len(data), columns * rows * max(1, bits // 8) * (3 if colour else 1))
    try:
        grey = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYDEPTH)
    except cv2.error:
        grey = None
    if grey is None:
        raise InputError(f"{file}: is a damaged PNG")
    return np.asarray(grey, dtype=float)


def read_numbers(file: Path) -> Floats:
    """Numbers (rows, columns) of a table, after a line of names or none; empty cells are NaN.

    Commas, semicolons, tabs or blanks part them.

    Raises:
        InputError: it is no such table.

    """
    size = file.stat().st_size
    check_expansion(file, size, 4 * size)  # a number takes two characters or more
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text") from None
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise InputError(f"{file}: holds no numbers")
    comma = next((mark for mark in ",;\t" if mark in lines[0]), None)
    if not all(_is_number(cell) for cell in lines[0].split(comma)):
        lines = lines[1:]
    widths = {len(line.split(comma)) for line in lines}
    if len(widths) != 1:
        raise InputError(f"{file}: its lines hold {sorted(widths)[:4]} numbers; all need as many")
    try:
        return np.array(
            [
                [float(cell) if cell.strip() else np.nan for cell in line.split(comma)]
                for line in lines
            ]
        )
    except ValueError:
        odd = [cell for line in lines for cell in line.split(comma) if not _is_number(cell)]
        raise InputError(
            f"{file}: {len(odd)} of its cells are no numbers, such as {odd[0].strip()!r}; leave "
            "cells without a height empty"
        ) from None


def _is_number(cell: str) -> bool:
    try:
        float(cell if cell.strip() else "nan")
    except ValueError:
        return False
    return True


def _array(file: Path) -> Floats:
    """``elevation`` (rows, columns) of an .npz."""
    try:
        held, others = read_arrays(file, {"elevation"})
        values = np.asarray(held["elevation"], dtype=float)
    except KeyError:
        raise InputError(
            f"{file}: holds no array named 'elevation', but {', '.join(sorted(others)) or 'none'}"
        ) from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{file}: is no .npz of numbers: {error}") from None
    if values.ndim != 2:
        raise InputError(f"{file}: 'elevation' must have rows and columns")
    return values
