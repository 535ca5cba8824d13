"""From a file of real ground to an elevation map in the robot's world."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.mapping.point_cloud import read_pcd, read_ply
from snakewalk.controller.mapping.raster_file import (
    DEGREE,
    RASTERS,
    UNITS_M,
    Crop,
    RasterUnits,
    read_numbers,
    read_raster,
)
from snakewalk.controller.terrain.elevation_map import CellHeight, ElevationMap

CLOUDS: Final = (".pcd", ".ply", ".xyz")
MESHES: Final = (".obj", ".stl", ".glb")
_MOST_HEIGHT_M: Final = 20_000.0
"""Beyond it a value is no height, but stands for none, or is in another unit (ours)."""
_MOST_SIZE_M: Final = 100_000.0
"""Of a map in the robot's world: a run's places reach a hundredth of it (ours)."""
ENDINGS: Final = (*RASTERS, *CLOUDS, *MESHES)
_POINTS_A_CELL: Final = 2.0
"""Of a cloud whose spacing is not given, in the mean (ours)."""
_MESH_SAMPLES: Final = 200
"""Along the longer side of a mesh whose spacing is not given (ours)."""


@dataclass(frozen=True, slots=True)
class MapOptions:
    """How a file becomes a map."""

    units: RasterUnits = field(default_factory=RasterUnits)
    """What the file leaves unsaid."""
    crop: Crop | None = None
    """Metres from the south-west corner of the file; None: all of it."""
    scale: float = 1.0
    """Metres in the robot's world per metre of the file."""
    vertical_scale: float | None = None
    """The same of heights; None: as ``scale``."""
    spacing_m: float | None = None
    """Between samples in the robot's world; None: as the file's, scaled."""
    height: CellHeight = "median"
    """Which of the points in a cell counts."""
    up: str = "z"
    """Axis of a mesh's or cloud's file that points up: y or z."""


@dataclass(frozen=True, slots=True)
class FileMap:
    """A map, and what of the file it shows."""

    elevation: ElevationMap
    size_m: tuple[float, float]
    """Extent in x and y of the part that was taken, in metres of the file."""
    relief_m: float
    """Highest less lowest of that part, in metres of the file."""
    kind: str
    """What the file holds: raster, points or triangles."""


def read_elevation(file: Path, options: MapOptions) -> FileMap:
    """Read a file by its ending.

    Raises:
        InputError: no such kind of file, damaged, too large, without units, or nothing in the crop.
        OSError: the file cannot be opened.

    """
    found = _read(file, options)
    size_m = (max(found.elevation.z_m.shape) - 1) * found.elevation.spacing_m
    if size_m > _MOST_SIZE_M:
        raise InputError(
            f"{file}: a map of {size_m:.3g} m at a scale of {options.scale:g}; the most is "
            f"{_MOST_SIZE_M:g} m: a smaller --scale, or --crop a part"
        )
    return found


def _read(file: Path, options: MapOptions) -> FileMap:
    ending = file.suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"{file}: ends in none of {' '.join(ENDINGS)}")
    if ending in (*CLOUDS, *MESHES):
        return _solid(file, options)
    if ending == ".csv":
        table = read_numbers(file)
        if table.shape[1] == 3:
            return _of_points(file, _upright(file, table, options), None, options)
    raster = read_raster(file, options.units, options.crop)
    scale, rise = options.scale, _rise(options)
    dx_m, dy_m = raster.dx_m * scale, raster.dy_m * scale
    spacing_m = min(dx_m, dy_m) if options.spacing_m is None else options.spacing_m
    rows, columns = raster.z_m.shape
    finite_m = raster.z_m[np.isfinite(raster.z_m)]
    highest_m = float(np.abs(finite_m).max(initial=0.0))
    if highest_m > _MOST_HEIGHT_M:
        raise InputError(
            f"{file}: holds heights of {highest_m:.3g} m: say which value is none (--no-data), or "
            "their --unit"
        )
    elevation = ElevationMap.of_raster(raster.z_m * rise, dx_m, dy_m, spacing_m)
    size_m = (columns - 1) * raster.dx_m, (rows - 1) * raster.dy_m
    return FileMap(elevation.centred(), size_m, _relief(raster.z_m), "raster")


def _solid(file: Path, options: MapOptions) -> FileMap:
    """Points or triangles."""
    ending, faces = file.suffix.lower(), None
    if ending == ".pcd":
        points = read_pcd(file)
    elif ending == ".xyz":
        points = read_numbers(file)[:, :3]
    elif ending == ".ply":
        points, faces = read_ply(file)
    else:
        require_extra("meshes need", "trimesh")
        from snakewalk.controller.images.mesh_files import read_mesh  # noqa: PLC0415  an extra

        mesh = read_mesh(file, "+x", "+z").mesh
        points, faces = mesh.vertices, mesh.faces
    return _of_points(file, _upright(file, points, options), faces, options)


def _upright(file: Path, points: Floats, options: MapOptions) -> Floats:
    """Finite points (n, 3) in metres, z up."""
    if options.units.unit == DEGREE:
        raise InputError(f"{file}: degrees are the unit of rasters alone")
    if points.shape[1] != 3:
        raise InputError(f"{file}: holds {points.shape[1]} numbers a point; x, y and z are needed")
    if options.units.no_data is not None:
        points = np.where(points == options.units.no_data, np.nan, points)
    turned = points if options.up == "z" else points[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    return np.asarray(turned * UNITS_M[options.units.unit or "m"])


def _of_points(file: Path, points_m: Floats, faces: Ints | None, options: MapOptions) -> FileMap:
    """Map of points, or of the triangles between them."""
    if faces is None:
        points_m = points_m[np.isfinite(points_m).all(axis=1)]
    if len(points_m) == 0:
        raise InputError(f"{file}: holds no point")
    corner = points_m[:, :2].min(axis=0)
    placed = points_m - [*corner, 0.0]
    low, high = np.zeros(2), placed[:, :2].max(axis=0)
    if options.crop is not None:
        whole = high
        low, high = np.maximum(options.crop[:2], low), np.minimum(options.crop[2:], high)
        if faces is None:
            placed = placed[((placed[:, :2] >= low) & (placed[:, :2] <= high)).all(axis=1)]
        if len(placed) == 0 or (low > high).any():
            raise InputError(
                f"{file}: nothing is within the crop: it is {whole[0]:.6g} m by {whole[1]:.6g} m"
            )
    if faces is None:
        low, high = placed[:, :2].min(axis=0), placed[:, :2].max(axis=0)
    size, kind = high - low, "points" if faces is None else "triangles"
    spacing_m = options.spacing_m
    if spacing_m is None:
        per_cell = math.sqrt(_POINTS_A_CELL * float(size.prod()) / len(placed))
        spacing_m = options.scale * (per_cell if faces is None else size.max() / _MESH_SAMPLES)
        if spacing_m <= 0.0:
            raise InputError(f"{file}: its points lie on a line, and span no ground")
        spacing_m = float(f"{spacing_m:.2g}")
    rise = _rise(options)
    scaled = placed * [options.scale, options.scale, rise]
    if faces is None:
        elevation = ElevationMap.of_points(scaled, spacing_m, options.height)
    else:
        corners = options.scale * low, options.scale * high
        elevation = ElevationMap.of_triangles(scaled, faces, *corners, spacing_m)
    relief_m = _relief(elevation.z_m) / rise
    return FileMap(elevation.centred(), (float(size[0]), float(size[1])), relief_m, kind)


def _rise(options: MapOptions) -> float:
    return options.scale if options.vertical_scale is None else options.vertical_scale


def _relief(z_m: Floats) -> float:
    return float(np.nanmax(z_m) - np.nanmin(z_m)) if np.isfinite(z_m).any() else 0.0
