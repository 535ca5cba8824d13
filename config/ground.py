"""Height field of a world: a real elevation model, or a generated shape."""

import math
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import scipy  # its modules load when they are first used

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.heightfield import HeightField, read_map
from snakewalk.config.world import (
    ElevationGround,
    FlatGround,
    GapsGround,
    MapGround,
    RampGround,
    RandomGround,
    ShoreGround,
    StepsGround,
    WaterGround,
    WorldConfig,
)


def build_ground(world: WorldConfig) -> HeightField | None:
    """Height field of ``world``, its lowest point at 0; None for a flat floor.

    It is centred on (0, 0), except for a map, whose file states its place, and a shore.

    Raises:
        ConfigError: the source is missing or unreadable, or the crop leaves it.

    """
    match world.ground:
        case FlatGround() | WaterGround():
            return None
        case MapGround() as ground:
            return _heights_from_map(world.name, ground)
        case ShoreGround() as ground:
            return _shore(ground)
        case ElevationGround() as ground:
            z = _cropped_map(world.name, ground)
            spacing_m = ground.spacing_m / ground.refine
        case RampGround() as ground:
            z = _ramp(ground)
            spacing_m = ground.spacing_m
        case RandomGround() as ground:
            z = _random(ground)
            spacing_m = ground.spacing_m
        case StepsGround() as ground:
            z = _steps(ground)
            spacing_m = ground.spacing_m
        case GapsGround() as ground:
            z = _gaps(ground)
            spacing_m = ground.spacing_m
    half_w, half_h = (z.shape[1] - 1) * spacing_m / 2, (z.shape[0] - 1) * spacing_m / 2
    return HeightField(z - z.min(), spacing_m, -half_w, -half_h)


def water_surface_m(world: WorldConfig, ground: HeightField | None) -> tuple[Floats, Floats] | None:
    """Centre (3,) and size (2,) of the water surface; None if dry.

    A shore's extends to the waterline.
    """
    water = world.ground
    if isinstance(water, WaterGround):
        west_m, long_m, wide_m = -0.5 * water.size_m, water.size_m, water.size_m
    elif isinstance(water, ShoreGround) and ground is not None:
        west_m, long_m, wide_m = ground.x0_m, -ground.x0_m, ground.size_m[1]
    else:
        return None
    return np.array([west_m + 0.5 * long_m, 0.0, water.depth_m]), np.array([long_m, wide_m])


def _heights_from_map(world: str, ground: MapGround) -> HeightField:
    try:
        field = read_map(Path(ground.source))
    except InputError as error:
        raise ConfigError([f"world {world}: ground: {fault}" for fault in error.faults]) from None
    z_m = ground.vertical_scale * (field.z_m - field.z_m.min())
    return replace(field, z_m=z_m)


def _ramp(ground: RampGround) -> Floats:
    """Exact if the kinks are on samples; else a kink is blunted by less than one spacing."""
    cells = _cells(2.0 * ground.level_m + ground.length_m, ground.spacing_m)
    x = (np.arange(cells + 1) - cells / 2) * ground.spacing_m
    rise = np.clip(x + ground.length_m / 2, 0.0, ground.length_m)
    return _drawn_out(math.tan(ground.slope_rad) * rise, ground.width_m, ground.spacing_m)


def _shore(ground: ShoreGround) -> HeightField:
    """Place the waterline at x = 0; kinks as for a ramp."""
    steep = math.tan(ground.slope_rad)
    under_m, over_m = ground.depth_m / steep, ground.rise_m / steep
    cells = _cells(ground.pool_m + under_m + over_m + ground.land_m, ground.spacing_m)
    x_m = np.arange(cells + 1) * ground.spacing_m - (ground.pool_m + under_m)
    profile_m = np.clip(ground.depth_m + steep * x_m, 0.0, ground.depth_m + ground.rise_m)
    z_m = _drawn_out(profile_m, ground.width_m, ground.spacing_m)
    south_m = -0.5 * (len(z_m) - 1) * ground.spacing_m
    return HeightField(z_m, ground.spacing_m, float(x_m[0]), south_m)


def _random(ground: RandomGround) -> Floats:
    """Smoothed white noise: a kernel's autocorrelation has twice its variance."""
    samples = _cells(ground.size_m, ground.spacing_m) + 1
    noise = np.random.default_rng(ground.seed).normal(size=(samples, samples))
    width = ground.correlation_m / 2.0 / ground.spacing_m
    z = scipy.ndimage.gaussian_filter(noise, width, mode="wrap", truncate=5.0)
    along_x, along_y = np.diff(z, axis=1), np.diff(z, axis=0)
    # Each cell has two triangles: one has the gradient of its lower and right edge, the other that
    # of its left and upper edge.
    square = (along_x[:-1] ** 2 + along_x[1:] ** 2).mean()
    square += (along_y[:, :-1] ** 2 + along_y[:, 1:] ** 2).mean()
    rms = np.sqrt(square / 2.0) / ground.spacing_m
    return np.asarray(z * (np.tan(ground.rms_slope_rad) / rms))


def _steps(ground: StepsGround) -> Floats:
    """Riser k is between the samples ``ends + k * tread - 1`` and the next one."""
    ends, tread = (_cells(m, ground.spacing_m) for m in (ground.level_m, ground.tread_m))
    column = np.arange(2 * ends + (ground.count - 1) * tread)
    risers = np.clip((column - ends) // tread + 1, 0, ground.count)
    level = risers if ground.pattern == "up" else risers % 2
    return _drawn_out(ground.height_m * level.astype(float), ground.width_m, ground.spacing_m)


def _gaps(ground: GapsGround) -> Floats:
    ends, width, distance = (
        _cells(m, ground.spacing_m) for m in (ground.level_m, ground.width_m, ground.distance_m)
    )
    column = np.arange(2 * ends + width + (ground.count - 1) * distance + 1) - ends
    within = column % distance  # from a trench's first edge
    cut = (column >= 0) & (column < ground.count * distance) & (within > 0) & (within < width)
    return _drawn_out(np.where(cut, 0.0, ground.depth_m), ground.across_m, ground.spacing_m)


def _cells(length_m: float, spacing_m: float) -> int:
    return max(1, round(length_m / spacing_m))


def _drawn_out(profile_m: Floats, width_m: float, spacing_m: float) -> Floats:
    """(rows, columns) of a profile along x, repeated along y."""
    return np.tile(profile_m, (_cells(width_m, spacing_m) + 1, 1))


def _cropped_map(world: str, ground: ElevationGround) -> Floats:
    """Crop, scale and refine a real elevation model.

    The crop counts rows from the north, like stored elevation models; here y grows to the north.
    Cubic refinement keeps the samples of the crop.
    """
    elevation = _elevation_m(world, ground.source)
    rows, columns = elevation.shape
    faults = [
        f"world {world}: ground: {name} {first} to {first + count - 1} leave "
        f"{ground.source}, which has {have}"
        for name, first, count, have in (
            ("rows", ground.row, ground.rows, rows),
            ("columns", ground.column, ground.columns, columns),
        )
        if first + count > have
    ]
    if faults:
        raise ConfigError(faults)
    crop = elevation[
        ground.row : ground.row + ground.rows, ground.column : ground.column + ground.columns
    ]
    if not np.isfinite(crop).all():
        raise ConfigError(f"world {world}: ground: the crop of {ground.source} has gaps")
    return _finer_heights(crop[::-1] * ground.vertical_scale, ground.refine)


def _elevation_m(world: str, source: str) -> Floats:
    """Samples (rows, columns) of the file's ``elevation``, row 0 in the north."""
    where = f"world {world}: ground: source {source}"
    path = _jacksboro(where) if source == "jacksboro" else Path(source)
    try:
        arrays, _ = read_arrays(path, {"elevation"})
        elevation = np.asarray(arrays["elevation"], dtype=float)
    except InputError as error:
        raise ConfigError(f"{where}: {error}") from None
    except OSError as error:
        raise ConfigError(f"{where}: {path}: {error.strerror or error}") from None
    except KeyError:
        raise ConfigError(f"{where}: {path}: holds no array named 'elevation'") from None
    except (ValueError, TypeError):
        raise ConfigError(
            f"{where}: {path}: is not an .npz with an array 'elevation' of numbers"
        ) from None
    if elevation.ndim != 2:
        raise ConfigError(f"{where}: {path}: 'elevation' must have rows and columns")
    return elevation


def _jacksboro(where: str) -> Path:
    """Path of the Jacksboro fault (3 arc seconds); the file's ymin and ymax are swapped."""
    package = find_spec("matplotlib")  # finds the folder without importing it
    if package is None or package.origin is None:
        raise ConfigError(
            f"{where}: comes with matplotlib, which is not installed: pip install 'snakewalk[view]'"
        )
    folder = Path(package.origin).parent / "mpl-data" / "sample_data"
    return folder / "jacksboro_fault_dem.npz"


def _finer_heights(z: Floats, refine: int) -> Floats:
    if refine == 1:
        return z
    rows, columns = np.arange(z.shape[0]), np.arange(z.shape[1])
    fine_rows = np.linspace(0, rows[-1], rows[-1] * refine + 1)
    fine_columns = np.linspace(0, columns[-1], columns[-1] * refine + 1)
    spline = scipy.interpolate.RectBivariateSpline(rows, columns, z)
    return np.asarray(spline(fine_rows, fine_columns), dtype=float)
