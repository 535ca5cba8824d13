"""Elevation map in the robot's world from a file of real ground."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from snakewalk.config.archive import ending
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import Assumptions, InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.file_units import unit_m
from snakewalk.config.reading import Fact, Facts, answered, by_user
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.geo_raster import read_geo_raster
from snakewalk.controller.mapping.las_file import in_metres, read_las
from snakewalk.controller.mapping.number_table import read_numbers
from snakewalk.controller.mapping.point_cloud import read_pcd, read_ply
from snakewalk.controller.mapping.point_units import points_in_metres
from snakewalk.controller.mapping.raster_file import (
    GEO_RASTERS,
    RASTERS,
    Crop,
    Raster,
    read_plain_raster,
)
from snakewalk.controller.terrain.elevation_map import ElevationMap

LOWEST_M = -430.0
"""Height of the lowest dry land: the shore of the Dead Sea, which sinks by a metre a year."""
HIGHEST_M = 8850.0
"""Height of the highest land: Mount Everest, 8848.86 m (China and Nepal, 2020)."""
_HIGHEST_M = 1e6
_GAP_M = 50.0
"""Step to all other heights, wider than their relief, that is suspicious (ours)."""
_MANY_EQUAL_CELLS = 3
"""Number of cells of one value that counts as a missing height (ours)."""


def check_heights(z_m: Floats, per_value_m: float, assumed: Assumptions) -> None:
    """Reject heights that are probably values of missing cells.

    Args:
        z_m: heights in metres; NaN for no data.
        per_value_m: metres per step of the file's values, for the suggestion.
        assumed: may state ``lowest_m`` and ``highest_m`` of the ground.

    Raises:
        InputError: the question.

    """
    finite = z_m[np.isfinite(z_m)]
    if not len(finite):
        return
    lowest_m = assumed.given("lowest_m", -_HIGHEST_M, _HIGHEST_M)
    highest_m = assumed.given("highest_m", -_HIGHEST_M, _HIGHEST_M)
    low, high = float(finite.min()), float(finite.max())
    if low < (LOWEST_M if lowest_m is None else lowest_m):
        raise InputError(
            _question(
                finite, low, per_value_m, f"no dry land lies below {LOWEST_M:g} m", "lowest_m"
            )
        )
    if high > (HIGHEST_M if highest_m is None else highest_m):
        raise InputError(
            _question(finite, high, per_value_m, f"no land is over {HIGHEST_M:g} m", "highest_m")
        )
    if lowest_m is None:
        _check_gap(finite, low, per_value_m)
    if highest_m is None:
        _check_gap(-finite, -high, -per_value_m)


def _check_gap(values: Floats, low: float, per_value_m: float) -> None:
    """Reject one value in many cells, far below all others (for negated values: above)."""
    count = int((values == low).sum())
    others = values[values > low]
    if count < _MANY_EQUAL_CELLS or not len(others):
        return
    gap = float(others.min()) - low
    relief = float(np.ptp(others))
    if gap > max(_GAP_M, relief):
        sign = 1.0 if per_value_m > 0.0 else -1.0
        side, key = ("below", "lowest_m") if sign > 0.0 else ("above", "highest_m")
        raise InputError(
            _question(
                sign * values, sign * low, abs(per_value_m), f"{gap:.4g} m {side} all others", key
            )
        )


def _question(finite: Floats, value: float, per_value_m: float, why: str, key: str) -> str:
    count = int((finite == value).sum())
    cells = f"{count} cell{'s' if count != 1 else ''}"
    return (
        f"holds heights of {value:.6g} m in {cells}: {why}; add "
        f"--no-data {value / per_value_m:.7g} if they are missing, "
        f"--assume {key}={value:.6g} if they are heights, or the right --height-unit"
    )


_FEW_SHARE = 0.2
"""Share of points that may be outliers (ours)."""
_SAME_PLACE = 1e-7
_EVEN_STEP = 0.01
"""Shares of a length in which places, and of a step in which steps, are the same (ours)."""
LASERS = (".las", ".laz")
CLOUDS = (".pcd", ".ply", ".xyz", *LASERS)
MESHES = (".obj", ".stl", ".glb")
_MOST_SIZE_M = 100_000.0
"""Largest size of a map in the robot's world: a run's places reach a hundredth of it (ours)."""
ENDINGS = (*RASTERS, *CLOUDS, *MESHES)
_POINTS_A_CELL = 2.0
"""Mean number of points in a cell of a cloud whose spacing is not given (ours)."""
_STACKED_SHARE, _STACKED_RELIEF, _STACKED_POINTS = 0.2, 0.5, 3
"""Share of the points, in cells with some of them, that lie one above the other by a share of the
relief: beyond it a cloud is not seen from above (ours)."""
_FEW_CELLS = 10
_TURNS = {
    "z": ((0, 1, 2), (1.0, 1.0, 1.0)), "-z": ((0, 1, 2), (1.0, -1.0, -1.0)),
    "y": ((0, 2, 1), (1.0, -1.0, 1.0)), "-y": ((0, 2, 1), (1.0, 1.0, -1.0)),
    "x": ((1, 2, 0), (1.0, 1.0, 1.0)), "-x": ((1, 2, 0), (1.0, -1.0, -1.0)),
}  # fmt: skip
"""Order and signs of the axes that turn one up, without mirroring."""
_MESH_SAMPLES = 200
"""Number of samples along the longer side of a mesh without a given spacing (ours)."""


@dataclass(frozen=True, slots=True)
class MapOptions:
    """Options of a map from a file."""

    choice: ElevationChoice = field(default_factory=ElevationChoice)
    """Facts that the file does not state."""
    crop: Crop | None = None
    """Metres from the south-west corner of the file; None: all of it."""
    scale: float = 1.0
    """Metres in the robot's world per metre of the file."""
    vertical_scale: float | None = None
    """Factor on the heights; None: as ``scale``."""
    spacing_m: float | None = None
    """Distance between samples in the robot's world; None: as in the file, scaled."""
    assumed: Assumptions = field(default_factory=Assumptions)
    """Values of ``choice.assume``, and which of them were used."""

    @property
    def rise(self) -> float:
        """Metres of height in the robot's world per metre of the file."""
        return self.scale if self.vertical_scale is None else self.vertical_scale


@dataclass(frozen=True, slots=True)
class FileMap:
    """A map, and the extent of its file."""

    elevation: ElevationMap
    size_m: tuple[float, float]
    """Extent in x and y of the part that was taken, in metres of the file."""
    relief_m: float
    """Highest less lowest of that part, in metres of the file."""
    kind: str
    """Content of the file: raster, points or triangles."""
    facts: Facts
    """Quantity, unit and order of the values."""
    notes: tuple[str, ...] = ()
    """Parts that were used, changed or left out."""


def read_elevation(file: Path, options: MapOptions) -> FileMap:
    """Read a file by its ending.

    Raises:
        InputError: unknown ending, damaged, too large, without units, or nothing in the crop.
        OSError: the file cannot be opened.

    """
    return answered(file, options.choice, lambda choice: _checked_map(file, choice, options))


def _checked_map(file: Path, choice: ElevationChoice, options: MapOptions) -> FileMap:
    assumed = Assumptions(choice.assume)
    elevation_file = _read(file, replace(options, choice=choice, assumed=assumed))
    assumed.check_used("keys: lowest_m, highest_m")
    size_m = (max(elevation_file.elevation.z_m.shape) - 1) * elevation_file.elevation.spacing_m
    if size_m > _MOST_SIZE_M:
        raise InputError(
            f"{file}: a map of {size_m:.3g} m at a scale of {options.scale:g}; the most is "
            f"{_MOST_SIZE_M:g} m: a smaller --scale, or --crop a part"
        )
    return replace(elevation_file, notes=(*elevation_file.notes, *assumed.lines))


def _read(file: Path, options: MapOptions) -> FileMap:
    kind = ending(file)
    if kind not in ENDINGS:
        raise InputError(f"{file}: ends in none of {' '.join(ENDINGS)}")
    if kind in (*CLOUDS, *MESHES):
        return _solid(file, options)
    if kind == ".csv":
        notes: list[str] = []
        names: list[str] = []
        table = read_numbers(file, notes, names, options.choice.columns)
        if table.shape[1] == 3 or names or options.choice.columns:
            points_m, facts = points_in_metres(file, table, names, options.choice)
            upright_m = _upright(file, points_m, options)
            return _of_points(file, upright_m, None, options, facts, notes)
    if kind in GEO_RASTERS:

        def spacing_of(dx_m: float, dy_m: float) -> float:
            least = min(dx_m, dy_m)
            return least if options.spacing_m is None else options.spacing_m / options.scale

        raster = read_geo_raster(file, options.choice, options.crop, spacing_of)
    else:
        raster = read_plain_raster(file, options.choice, options.crop)
    return _of_raster(file, raster, options)


def _of_raster(file: Path, raster: Raster, options: MapOptions) -> FileMap:
    scale = options.scale
    rise = options.rise
    dx_m, dy_m = raster.dx_m * scale, raster.dy_m * scale
    spacing_m = min(dx_m, dy_m) if options.spacing_m is None else options.spacing_m
    rows, columns = raster.z_m.shape
    _check_heights(file, raster.z_m, raster.per_value_m, options)
    elevation = ElevationMap.of_raster(raster.z_m * rise, dx_m, dy_m, spacing_m)
    size_m = (columns - 1) * raster.dx_m, (rows - 1) * raster.dy_m
    facts = _facts("raster", "rows from the north", options.choice, raster.facts)
    relief_m = _relief(raster.z_m)
    return FileMap(elevation.centred(), size_m, relief_m, "raster", facts, raster.notes)


def _facts(kind: str, order: str, choice: ElevationChoice, units: Facts) -> Facts:
    return {
        "quantity": Fact(f"heights ({kind})", "file", "its format"),
        **units,
        "order": by_user("--up", choice.up and order) or Fact(order, "file", "its format"),
    }


def _check_heights(file: Path, z_m: Floats, per_value_m: float, options: MapOptions) -> None:
    try:
        check_heights(z_m, per_value_m, options.assumed)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _solid(file: Path, options: MapOptions) -> FileMap:
    kind = ending(file)
    faces = None
    notes: list[str] = []
    names: list[str] = []
    if kind in LASERS:
        return _of_laser(file, options)
    if kind == ".pcd":
        cloud = read_pcd(file)
        points = cloud.points
        if cloud.image is not None and options.choice.up is None:
            raise InputError(
                f"{file}: is a depth picture of {cloud.image[0]} by {cloud.image[1]} points "
                "without a direction up; add --up -y if y points down in the picture, or --up "
                "z if it is upright"
            )
        notes += cloud.notes
    elif kind == ".xyz":
        points = read_numbers(file, notes, names, options.choice.columns)
    elif kind == ".ply":
        points, faces = read_ply(file)
    else:
        require_extra("meshes need", "trimesh")
        from snakewalk.controller.images.mesh_files import read_mesh  # noqa: PLC0415  an extra

        mesh = read_mesh(file, "+x", "+z").mesh
        points = mesh.vertices
        faces = mesh.faces
    points_m, facts = points_in_metres(file, points, names, options.choice)
    return _of_points(file, _upright(file, points_m, options), faces, options, facts, notes)


def _of_laser(file: Path, options: MapOptions) -> FileMap:
    choice = options.choice
    laser_points = read_las(file, choice.classes, options.crop, choice.unit)
    points_m, facts, notes = in_metres(file, laser_points, choice.unit, choice.height_unit)
    left = replace(options, crop=None) if laser_points.cropped else options
    return _of_points(file, points_m, None, left, facts, [*laser_points.notes, *notes])


def _up(file: Path, choice: ElevationChoice) -> str:
    """Axis that points up: glTF defines y."""
    return choice.up or ("y" if ending(file) == ".glb" else "z")


def _upright(file: Path, points_m: Floats, options: MapOptions) -> Floats:
    """Points (n, 3) in metres, z up."""
    order, signs = _TURNS[_up(file, options.choice)]
    return np.ascontiguousarray(points_m[:, order] * signs)


def _of_points(
    file: Path,
    points_m: Floats,
    faces: Ints | None,
    options: MapOptions,
    units: Facts,
    notes: list[str],
) -> FileMap:
    choice = options.choice
    if faces is None:
        finite = np.isfinite(points_m).all(axis=1)
        if not finite.all():
            notes.append(f"{int((~finite).sum())} points without numbers are left out")
            points_m = points_m[finite]
    if len(points_m) == 0:
        raise InputError(f"{file}: holds no point")
    if faces is None and choice.classes is None:
        points_m = _without_outliers(file, points_m, options.assumed, notes)
    _check_heights(file, points_m[:, 2], unit_m(units["height_unit"].value), options)
    placed, low, high = _cropped_points(file, points_m, options.crop, is_mesh=faces is not None)
    size = high - low
    kind = "points" if faces is None else "triangles"
    spacing_m = options.spacing_m
    if spacing_m is None:
        step_m = None if faces is not None else _grid_step(placed, size)
        if step_m is not None:
            notes.append(f"points lie on a grid of {step_m:.6g} m")
        spacing_m = options.scale * (step_m or _usual_step(file, placed, size, faces))
    rise = options.rise
    scaled = placed * [options.scale, options.scale, rise]
    if faces is None:
        if choice.point is None and choice.up is None:
            _check_seen_from_above(file, scaled, spacing_m)
        elevation = ElevationMap.of_points(scaled, spacing_m, choice.point or "median")
    else:
        corners = options.scale * low, options.scale * high
        elevation = ElevationMap.of_triangles(scaled, faces, *corners, spacing_m)
    relief_m = _relief(elevation.z_m) / rise
    whole_m = float(size[0]), float(size[1])
    facts = _facts(kind, f"{_up(file, choice)} up", choice, units)
    return FileMap(elevation.centred(), whole_m, relief_m, kind, facts, tuple(notes))


def _usual_step(file: Path, placed_m: Floats, size_m: Floats, faces: Ints | None) -> float:
    per_cell_m = math.sqrt(_POINTS_A_CELL * float(size_m.prod()) / len(placed_m))
    step_m = per_cell_m if faces is None else float(size_m.max()) / _MESH_SAMPLES
    if step_m <= 0.0:
        raise InputError(f"{file}: its points lie on a line, and span no ground")
    return float(f"{step_m:.2g}")


def _grid_step(placed_m: Floats, size_m: Floats) -> float | None:
    """Step of points (n, 3) from (0, 0) on a square grid that they fill by half; else None."""
    steps_m = []
    cells = 1
    for places_m, length_m in zip(placed_m[:, :2].T, size_m, strict=True):
        if length_m <= 0.0:
            return None
        numbers = np.unique(np.rint(places_m / (_SAME_PLACE * length_m)))
        cells *= len(numbers)
        step = np.diff(numbers)
        if step.max() > (1.0 + _EVEN_STEP) * step.min():
            return None
        steps_m.append(float(length_m / len(step)))
    is_square = max(steps_m) <= (1.0 + _EVEN_STEP) * min(steps_m)
    return min(steps_m) if is_square and 2 * len(placed_m) >= cells else None


def _without_outliers(
    file: Path, points_m: Floats, assumed: Assumptions, notes: list[str]
) -> Floats:
    """Points (n, 3) between the stated heights of the ground, or all.

    Raises:
        InputError: nothing is stated, and a few points lie far above or below all others (the
            question).

    """
    z_m = points_m[:, 2]
    is_ground = np.ones(len(z_m), dtype=bool)
    for key, sign, side in (("highest_m", 1.0, "above"), ("lowest_m", -1.0, "below")):
        heights_m = np.sort(sign * z_m)
        last_m = heights_m[int((1.0 - _FEW_SHARE) * len(z_m)) :]
        stated_m = assumed.given(key, -_HIGHEST_M, _HIGHEST_M)
        if stated_m is not None:
            is_ground &= sign * z_m <= sign * stated_m
        elif len(last_m) > 1:
            k = int(np.argmax(np.diff(last_m)))
            gap_m = float(last_m[k + 1] - last_m[k])
            if gap_m > max(_GAP_M, float(last_m[k] - heights_m[0])):
                few = len(last_m) - k - 1
                end_m, extreme_m = (sign * math.ceil(place_m) for place_m in last_m[[k, -1]])
                raise InputError(
                    f"{file}: {few} points ({100.0 * few / len(z_m):.2g} %) lie {gap_m:.4g} m "
                    f"{side} all others; add --assume {key}={end_m:g} to leave them out, or "
                    f"--assume {key}={extreme_m:g} if they are ground"
                )
    if not is_ground.all():
        notes.append(f"{int((~is_ground).sum())} points beyond the stated heights are left out")
    return points_m[is_ground]


def _cropped_points(
    file: Path,
    points_m: Floats,
    crop: tuple[float, float, float, float] | None,
    *,
    is_mesh: bool,
) -> tuple[Floats, Floats, Floats]:
    """Move points to their corner; return those within the crop, and its two corners (2,).

    The triangles of a mesh are cut later, so that all its points stay.
    """
    corner = points_m[:, :2].min(axis=0)
    placed = points_m - [*corner, 0.0]
    low = np.zeros(2)
    high = placed[:, :2].max(axis=0)
    if crop is not None:
        size_m = high
        low, high = np.maximum(crop[:2], low), np.minimum(crop[2:], high)
        if not is_mesh:
            placed = placed[((placed[:, :2] >= low) & (placed[:, :2] <= high)).all(axis=1)]
        if len(placed) == 0 or (low > high).any():
            raise InputError(
                f"{file}: nothing is within the crop: it is {size_m[0]:.6g} m by {size_m[1]:.6g} m"
            )
    if not is_mesh:
        low, high = placed[:, :2].min(axis=0), placed[:, :2].max(axis=0)
    return placed, low, high


def _check_seen_from_above(file: Path, points_m: Floats, spacing_m: float) -> None:
    """Reject a cloud with many points above each other: walls, interiors, a camera's view.

    Raises:
        InputError: the question.

    """
    low = points_m[:, :2].min(axis=0)
    place = np.rint((points_m[:, :2] - low) / spacing_m).astype(np.int64)
    _, cell = np.unique(place, axis=0, return_inverse=True)
    cell = cell.ravel()
    count = np.bincount(cell)
    lowest = np.full(len(count), np.inf)
    highest = np.full(len(count), -np.inf)
    np.minimum.at(lowest, cell, points_m[:, 2])
    np.maximum.at(highest, cell, points_m[:, 2])
    relief_m = float(np.ptp(points_m[:, 2]))
    several = count >= _STACKED_POINTS
    if several.sum() < _FEW_CELLS or relief_m <= 0.0:
        return
    stacked = several & (highest - lowest > max(_STACKED_RELIEF * relief_m, spacing_m))
    share = float(count[stacked].sum() / count[several].sum())
    if share > _STACKED_SHARE:
        raise InputError(
            f"{file}: is not ground seen from above: {100.0 * share:.0f} % of its points share a "
            f"cell whose heights differ by over {100.0 * _STACKED_RELIEF:.0f} % of the relief; "
            "add --up AXIS, or --point lowest, median or highest"
        )


def _relief(z_m: Floats) -> float:
    return float(np.nanmax(z_m) - np.nanmin(z_m)) if np.isfinite(z_m).any() else 0.0
