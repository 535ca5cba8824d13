"""GeoTIFF and ASCII grid: heights with the file's units, scale and missing cells.

Large files are read in strips, with the median of the heights per sample.
"""

import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import ending, read_bytes
from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.file_units import DEGREE, named_unit, unit_m, unit_name
from snakewalk.config.heightfield import MOST_SAMPLES
from snakewalk.config.reading import Fact, by_file, by_user, decided
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.length_units import (
    SYSTEM,
    UNSTATED_UNIT,
    degree_cell_m,
    ground_lengths,
    height_fact,
    vertical_unit,
)
from snakewalk.controller.mapping.raster_file import (
    Crop,
    Raster,
    raster_window,
)

MOST_STRIPPED_CELLS = 1_000_000_000
"""Most cells of a raster that is read in strips (ours)."""
_MOST_CELLS = 4 * MOST_SAMPLES
"""Largest number of cells that are read at once; more would make too many samples."""
_STRIP_CELLS = 2_000_000
"""Largest number of cells in a window that is read at once (ours)."""
_COARSER = 2.0
"""Spacing of a map over a raster's from which strips are read (ours)."""
_CACHE_BYTES = 64_000_000
"""Cache of GDAL's blocks (ours)."""
_COLOURS = ("palette", "red", "green", "blue", "alpha", "hue", "cyan", "magenta")
"""Meanings of a band (GDAL's color interpretation) that exclude heights."""
_DEGREES_LIKE = 1.0 / 60.0 + 1e-9
"""Largest cell in degrees: a minute, 1.8 km (ours)."""


def read_geo_raster(
    file: Path,
    units: ElevationChoice,
    crop: Crop | None,
    spacing_of: Callable[[float, float], float] | None,
) -> Raster:
    """Read a GeoTIFF or an ASCII grid, or its part within a crop.

    Args:
        file: ends in .tif, .tiff or .asc.
        units: stated by the user.
        crop: of the file.
        spacing_of: maps a cell's width and depth, m, to the spacing of the map, m of the file; a
            finer raster is reduced while it is read.

    Raises:
        InputError: it cannot be read, or lacks necessary facts.
        OSError: the file cannot be opened.

    """
    require_extra("GeoTIFF and ASCII grid need", "rasterio")
    import rasterio  # noqa: PLC0415  an extra

    driver = "AAIGrid" if ending(file) == ".asc" else "GTiff"
    is_packed = ending(file) != file.suffix.lower()
    with file.open("rb"):  # reports a fault of the system as such
        source = io.BytesIO(read_bytes(file)) if is_packed else file.absolute()
    try:
        with (
            rasterio.Env(GTIFF_REPORT_COMPD_CS=True, GDAL_CACHEMAX=_CACHE_BYTES),
            rasterio.open(source, driver=driver) as opened,
        ):
            return _read(file, opened, units, crop, spacing_of)
    except (rasterio.errors.RasterioError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as {driver}: {error}") from None


@dataclass(frozen=True, slots=True)
class _Cells:
    """Size of a raster's cells, and what states it."""

    dx_m: float
    dy_m: float
    height_unit: str
    notes: list[str]


def _read(
    file: Path,
    opened: Any,
    units: ElevationChoice,
    crop: Crop | None,
    spacing_of: Callable[[float, float], float] | None,
) -> Raster:
    if opened.count != 1 and opened.dtypes[0] == "uint8":
        raise InputError(f"{file}: is a picture of {opened.count} bands, and holds no heights")
    if opened.dtypes[0].startswith("complex"):
        raise InputError(f"{file}: has complex numbers, and no heights; choose another file")
    colour = opened.colorinterp[0].name
    if colour in _COLOURS:
        meaning = "classes" if colour == "palette" else "a picture"
        raise InputError(
            f"{file}: its band is marked as {colour}: its values are {meaning}, not heights; "
            "choose a file of heights"
        )
    turn = opened.transform
    if not (math.isclose(turn.b, 0.0) and math.isclose(turn.d, 0.0)):
        raise InputError(f"{file}: its rows do not run west to east: warp it north up")
    if units.cell is None and turn.is_identity and opened.crs is None:
        raise InputError(
            f"{file}: states no size of its cells; give --cell, the distance between two samples"
        )
    unit_fact = by_user("--unit", units.unit) or _horizontal_unit(file, opened)
    unit = unit_fact.value
    dx, dy = (abs(turn.a), abs(turn.e)) if units.cell is None else (units.cell,) * 2
    full_window = slice(0, opened.height), slice(0, opened.width)
    all_cells = _cells(file, opened, unit, (dx, dy), full_window)
    rows, columns = raster_window(
        file, opened.shape, all_cells.dx_m, all_cells.dy_m, crop, turn.e < 0.0, MOST_STRIPPED_CELLS
    )
    cropped_cells = _cells(file, opened, unit, (dx, dy), (rows, columns)) if crop else all_cells
    height = _height_unit(file, opened, units, unit_fact)
    height_unit = height.value
    notes = cropped_cells.notes
    if opened.count > 1:
        notes.append(f"band 1 of {opened.count} is read")
    scale, offset, words = _band_scale(opened, units)
    notes += words
    per_unit = scale * unit_m(height_unit)
    spacing_m = 0.0 if spacing_of is None else spacing_of(cropped_cells.dx_m, cropped_cells.dy_m)
    strips = _Strips(opened, rows, columns, units.no_data)
    if spacing_m >= _COARSER * max(cropped_cells.dx_m, cropped_cells.dy_m):
        z, absent = strips.reduced(cropped_cells.dx_m, cropped_cells.dy_m, spacing_m)
        notes.append(
            f"{strips.cells} cells are reduced to {z.size} medians, {spacing_m:.4g} m apart"
        )
        dx_m, dy_m = spacing_m, spacing_m
    else:
        if strips.cells > _MOST_CELLS:
            raise InputError(
                f"{file}: {columns.stop - columns.start} by {rows.stop - rows.start} cells are "
                f"over {_MOST_CELLS}: give a --spacing of {_COARSER:g} cells or more, or --crop a "
                f"part of its {opened.width * all_cells.dx_m:.6g} m by "
                f"{opened.height * all_cells.dy_m:.6g} m"
            )
        z, absent = strips.plain()
        dx_m, dy_m = cropped_cells.dx_m, cropped_cells.dy_m
    z = (z * per_unit) + offset * unit_m(height_unit)
    if absent:
        notes.append(f"{absent} cells hold no height")
    upright = z[::-1] if turn.e < 0.0 else z
    facts = {"unit": unit_fact, "height_unit": height}
    return Raster(np.ascontiguousarray(upright), dx_m, dy_m, facts, tuple(notes), per_unit)


class _Strips:
    """Reads a part of a band strip by strip; missing cells are NaN, rows in the file's order."""

    def __init__(self, opened: Any, rows: slice, columns: slice, no_data: float | None) -> None:
        self._opened = opened
        self._rows = rows
        self._columns = columns
        self._no_data = no_data
        self._width = columns.stop - columns.start
        self.cells = self._width * (rows.stop - rows.start)

    def plain(self) -> tuple[Floats, int]:
        values = self._strip(self._rows.start, self._rows.stop)
        return values, int(np.isnan(values).sum())

    def reduced(self, dx_m: float, dy_m: float, spacing_m: float) -> tuple[Floats, int]:
        """Medians of the cells nearest to each sample, and the number of missing cells."""
        count = self._rows.stop - self._rows.start
        # counted from the south, where the map begins
        row_of = np.rint((count - 1 - np.arange(count)) * dy_m / spacing_m).astype(np.int64)
        column_of = np.rint(np.arange(self._width) * dx_m / spacing_m).astype(np.int64)
        from_south = self._opened.transform.e > 0.0
        if from_south:
            row_of = row_of[::-1]
        samples = int(row_of.max()) + 1, int(column_of.max()) + 1
        if samples[0] * samples[1] > MOST_SAMPLES:
            coarse_m = spacing_m * math.sqrt(samples[0] * samples[1] / MOST_SAMPLES)
            raise InputError(
                f"{self._opened.name}: {samples[1]} by {samples[0]} samples are over "
                f"{MOST_SAMPLES}; use a --spacing of {coarse_m:.3g} m of the file or more, or "
                "--crop a part"
            )
        out = np.full(samples, np.nan)
        absent = 0
        ends = [*(np.flatnonzero(np.diff(row_of)) + 1).tolist(), count]
        most = max(1, _STRIP_CELLS // self._width)
        begin = 0
        for k, end in enumerate(ends):
            if k + 1 < len(ends) and ends[k + 1] - begin <= most:
                continue  # the next group of rows fits into the same strip
            z = self._strip(self._rows.start + begin, self._rows.start + end)
            absent += int(np.isnan(z).sum())
            for sample in np.unique(row_of[begin:end]):
                place = sample if from_south else samples[0] - 1 - sample
                chosen = z[row_of[begin:end] == sample]
                out[place] = _column_medians(chosen, column_of, samples[1])
            begin = end
        return out, absent

    def _strip(self, first: int, last: int) -> Floats:
        part = ((first, last), (self._columns.start, self._columns.stop))
        values = self._opened.read(1, window=part, out_dtype="float64")
        missing: Bools = self._opened.read_masks(1, window=part) == 0
        missing |= ~np.isfinite(values)
        if self._no_data is not None:
            missing |= values == self._no_data
        values[missing] = np.nan
        return np.asarray(values)


def _column_medians(z: Floats, column_of: Ints, samples: int) -> Floats:
    """Median over the rows of z and the columns of each sample, without NaN."""
    starts = np.searchsorted(column_of, np.arange(samples))
    widths = np.diff([*starts, len(column_of)])
    padded = np.full((samples, len(z) * int(widths.max())), np.nan)
    for k in range(int(widths.max())):
        has = widths > k
        padded[has, k * len(z) : (k + 1) * len(z)] = z[:, starts[has] + k].T
    padded.sort(axis=1)  # NaN is last
    count = np.isfinite(padded).sum(axis=1)
    low, high = np.maximum((count - 1) // 2, 0), np.maximum(count // 2, 0)
    sample_index = np.arange(samples)
    high = np.minimum(high, padded.shape[1] - 1)
    return np.where(
        count > 0, 0.5 * (padded[sample_index, low] + padded[sample_index, high]), np.nan
    )


def _horizontal_unit(file: Path, opened: Any) -> Fact:
    """Unit of the cells by the coordinate system.

    Raises:
        InputError: the system is missing, and the cells may be degrees.

    """
    crs = opened.crs
    turn = opened.transform
    if crs is not None:
        if crs.is_geographic:
            return Fact(DEGREE, "file", SYSTEM)
        try:
            return Fact(unit_name(float(crs.linear_units_factor[1])), "file", SYSTEM)
        except (ValueError, LookupError, TypeError) as error:
            raise InputError(f"{file}: its system states no unit ({error}); add --unit") from None
    west = turn.c
    north = turn.f
    east = west + turn.a * opened.width
    south = north + turn.e * opened.height
    cell = max(abs(turn.a), abs(turn.e))
    within = min(west, east) >= -180.0 and max(west, east) <= 360.0
    within &= min(south, north) >= -90.0 and max(south, north) <= 90.0
    if not within or cell > _DEGREES_LIKE:
        return Fact("m", "inferred", UNSTATED_UNIT)
    latitude = min(max(0.5 * (north + south), -89.0), 89.0)
    wide_m, deep_m = degree_cell_m(abs(turn.a), abs(turn.e), latitude)
    readings = {
        DEGREE: f"degrees, {wide_m:.4g} m by {deep_m:.4g} m",
        "m": f"metres, {cell:.4g} m",
    }
    return decided(file, "states no system; its cells are", "--unit", readings, None)


def _height_unit(file: Path, opened: Any, units: ElevationChoice, horizontal: Fact) -> Fact:
    """Unit of heights: by the user, the band, or the vertical part of the system.

    Raises:
        InputError: it is not stated and lengths may not be metres, or statements differ.

    """
    if units.height_unit is not None:
        return Fact(units.height_unit, "user", "--height-unit")
    words = (opened.units[0] or "").strip()
    band = named_unit(words) if words else None
    if words and band is None:
        raise InputError(f"{file}: its heights are in {words!r}; state --height-unit: m, ft, ...")
    vertical = None if opened.crs is None else vertical_unit(opened.crs.to_wkt())
    if units.unit is not None and units.unit != DEGREE:
        stated = vertical or band
        differs = stated is not None and not math.isclose(unit_m(stated), unit_m(units.unit))
        return Fact(
            units.unit, "user", f"--unit; the file states {stated}" if differs else "--unit"
        )
    if band is not None and vertical is not None and band != vertical:
        raise InputError(
            f"{file}: states heights in {band} (band), {vertical} (system); choose by --height-unit"
        )
    return by_file("its band", band) or height_fact(
        file, horizontal, None, by_file(SYSTEM, vertical)
    )


def _band_scale(opened: Any, units: ElevationChoice) -> tuple[float, float, list[str]]:
    """Factor and offset of the band's values; --height-step replaces them."""
    scale = float(opened.scales[0])
    offset = float(opened.offsets[0])
    if units.height_step is not None:
        stated = (scale, offset) != (1.0, 0.0)
        words = [f"the band's scale {scale:g} and offset {offset:g} are left out for --height-step"]
        return units.height_step, 0.0, words if stated else []
    if (scale, offset) == (1.0, 0.0):
        return 1.0, 0.0, []
    if not (math.isfinite(scale) and math.isfinite(offset)) or scale == 0.0:
        raise InputError(f"its band has a scale of {scale:g} and an offset of {offset:g}")
    return scale, offset, [f"heights are {scale:g} times the values plus {offset:g}, as it states"]


def _cells(
    file: Path, opened: Any, unit: str, cell: tuple[float, float], part: tuple[slice, slice]
) -> _Cells:
    turn, (rows, columns) = opened.transform, part
    middle_x = turn.c + turn.a * 0.5 * (columns.start + columns.stop)
    middle_y = turn.f + turn.e * 0.5 * (rows.start + rows.stop)
    if unit == DEGREE:
        if not -89.0 <= middle_y <= 89.0:
            raise InputError(
                f"{file}: its middle has no latitude from -89 to 89; for metres add --unit m"
            )
        return _Cells(*degree_cell_m(*cell, middle_y), "m", [])
    per_unit_m = unit_m(unit)
    notes: list[str] = []
    scale_x, scale_y = per_unit_m, per_unit_m
    if opened.crs is not None and not opened.crs.is_geographic:
        edge_y = [turn.f + turn.e * row for row in (rows.start, rows.stop)]
        edge_x = [turn.c + turn.a * column for column in (columns.start, columns.stop)]
        places = [
            (middle_x, middle_y),
            *((middle_x, y) for y in edge_y),
            *((x, middle_y) for x in edge_x),
        ]
        try:
            scale_x, scale_y, notes = ground_lengths(opened.crs, per_unit_m, places, cell)
        except InputError as error:
            raise InputError(f"{file}: {error}") from None
    return _Cells(cell[0] * scale_x, cell[1] * scale_y, unit, notes)
