"""Raster files without a coordinate system: pictures, tables and arrays of numbers.

Rows are stored from the north, like elevation models and pictures; in a ``Raster`` y grows.
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.archive import check_expansion, ending, read_arrays, read_bytes
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.file_units import DEGREE, unit_m
from snakewalk.config.reading import Fact, Facts
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.number_table import read_numbers

GEO_RASTERS = (".tif", ".tiff", ".asc")
RASTERS = (*GEO_RASTERS, ".png", ".csv", ".npz")
MOST_CELLS = 40_000_000
"""Most cells of a raster that is read at once (ours): 320 MB as numbers."""
Crop = tuple[float, float, float, float]
"""Least x and y, greatest x and y, in metres from the south-west corner of the file's content."""


@dataclass(frozen=True, slots=True)
class Raster:
    """Heights on a grid of rectangular cells."""

    z_m: Floats
    """(rows, columns), row 0 in the south; NaN where the file has no data."""
    dx_m: float
    """Distance between columns."""
    dy_m: float
    """Distance between rows."""
    facts: Facts
    """Units of the file."""
    notes: tuple[str, ...] = ()
    """Statements of the file that were used or left out, for the result."""
    per_value_m: float = 1.0
    """Metres of a step of one in the file's values."""


def read_plain_raster(file: Path, units: ElevationChoice, crop: Crop | None) -> Raster:
    """Read a PNG, a CSV or an NPZ, or its part within a crop.

    Raises:
        InputError: it cannot be read, has no heights, is too large, has an unknown cell size, or no
            cell within the crop.
        OSError: the file cannot be opened.

    """
    kind = ending(file)
    notes: list[str] = []
    if kind == ".csv":
        values = read_numbers(file, notes)
    else:
        values = _picture(file) if kind == ".png" else _array(file)
    if kind == ".png" and units.height_step is None:
        raise InputError(
            f"{file}: a picture states no heights; give --height-step, the height of one grey level"
        )
    if units.cell is None:
        raise InputError(
            f"{file}: states no size of its cells; give --cell, the distance between two samples"
        )
    if units.unit == DEGREE:
        raise InputError(
            f"{file}: states no latitude, so degrees cannot be converted to lengths; add --unit m"
        )
    unit = units.unit or "m"
    height_unit = units.height_unit or unit
    facts = {
        "unit": Fact(unit, "user", "--cell, --unit"),
        "height_unit": Fact(height_unit, "user", "--height-step, --height-unit"),
    }
    cell_m = units.cell * unit_m(unit)
    rows, columns = raster_window(file, values.shape, cell_m, cell_m, crop)
    per_value_m = (units.height_step or 1.0) * unit_m(height_unit)
    z = np.array(values[rows, columns], dtype=float)
    if units.no_data is not None:
        z[z == units.no_data] = np.nan
    z[~np.isfinite(z)] = np.nan
    absent = int(np.isnan(z).sum())
    if absent:
        notes.append(f"{absent} cells hold no height")
    upright = np.ascontiguousarray(z[::-1] * per_value_m)
    return Raster(upright, cell_m, cell_m, facts, tuple(notes), per_value_m)


def raster_window(
    file: Path,
    shape: tuple[int, int],
    dx_m: float,
    dy_m: float,
    crop: Crop | None,
    from_north: bool = True,
    most_cells: int = MOST_CELLS,
) -> tuple[slice, slice]:
    """Rows and columns of a file within a crop.

    Raises:
        InputError: they are fewer than 2 by 2, or over ``most_cells``.

    """
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
    if (right - left) * (top - bottom) > most_cells:
        raise InputError(
            f"{file}: {right - left} by {top - bottom} cells are over {most_cells}: --crop a part "
            f"of its {columns * dx_m:.6g} m by {rows * dy_m:.6g} m"
        )
    down = slice(rows - top, rows - bottom) if from_north else slice(bottom, top)
    return down, slice(left, right)


def _span(low_m: float, high_m: float, step_m: float, count: int) -> tuple[int, int]:
    """First and end cell with their middle within a span."""
    first = max(0, math.ceil(low_m / step_m - 0.5 - 1e-9))
    last = count if math.isinf(high_m) else math.floor(high_m / step_m - 0.5 + 1e-9) + 1
    return first, min(count, last)


def _picture(file: Path) -> Floats:
    """Grey levels (rows, columns) of an 8 or 16 bit picture."""
    require_extra("pictures need", "cv2")
    import cv2  # noqa: PLC0415  an extra

    data = read_bytes(file)
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


def _array(file: Path) -> Floats:
    """``elevation`` (rows, columns) of an .npz."""
    try:
        arrays, others = read_arrays(file, {"elevation"})
        values = np.asarray(arrays["elevation"], dtype=float)
    except KeyError:
        raise InputError(
            f"{file}: holds no array named 'elevation', but {', '.join(sorted(others)) or 'none'}"
        ) from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{file}: is no .npz of numbers: {error}") from None
    if values.ndim != 2:
        raise InputError(f"{file}: 'elevation' must have rows and columns")
    return values
