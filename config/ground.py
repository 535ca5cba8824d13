"""From a world's description to its height field: crop, scale and refine a real elevation model."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
from scipy.interpolate import RectBivariateSpline

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import ConfigError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import ElevationGround, WorldConfig


def build_ground(world: WorldConfig) -> HeightField | None:
    """Height field of ``world``, centred on (0, 0), its lowest point at 0; None on a flat floor.

    The crop counts rows from the north, as elevation models are stored; here y grows to the north.
    Cubic refinement keeps the samples of the crop.

    Raises:
        ConfigError: the source is missing or unreadable, or the crop leaves it.

    """
    ground = world.ground
    if not isinstance(ground, ElevationGround):
        return None
    elevation = _elevation_m(world.name, ground.source)
    rows, columns = elevation.shape
    faults = [
        f"world {world.name}: ground: {name} {first} to {first + count - 1} leave "
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
        raise ConfigError(f"world {world.name}: ground: the crop of {ground.source} has gaps")
    z = _refined(crop[::-1] * ground.vertical_scale, ground.refine)
    spacing = ground.spacing_m / ground.refine
    half_w, half_h = (z.shape[1] - 1) * spacing / 2, (z.shape[0] - 1) * spacing / 2
    return HeightField(z - z.min(), spacing, -half_w, -half_h)


def _elevation_m(world: str, source: str) -> Floats:
    """Read samples (rows, columns), row 0 in the north, as the file's ``elevation`` holds them."""
    where = f"world {world}: ground: source {source}"
    path = _jacksboro(where) if source == "jacksboro" else Path(source)
    try:
        with np.load(path) as data:
            elevation = np.asarray(data["elevation"], dtype=float)
    except OSError as error:
        raise ConfigError(f"{where}: {path}: {error.strerror or error}") from None
    except KeyError:
        raise ConfigError(f"{where}: {path}: holds no array named 'elevation'") from None
    except (ValueError, TypeError, AttributeError) as error:
        raise ConfigError(f"{where}: {path}: is not an .npz of arrays: {error}") from None
    if elevation.ndim != 2:
        raise ConfigError(f"{where}: {path}: 'elevation' must have rows and columns")
    return elevation


def _jacksboro(where: str) -> Path:
    """Find the Jacksboro fault (3 arc seconds); its ymin and ymax are swapped in the file."""
    package = find_spec("matplotlib")  # finds the folder without importing it
    if package is None or package.origin is None:
        raise ConfigError(
            f"{where}: comes with matplotlib, which is not installed: pip install 'snakewalk[view]'"
        )
    folder = Path(package.origin).parent / "mpl-data" / "sample_data"
    return folder / "jacksboro_fault_dem.npz"


def _refined(z: Floats, refine: int) -> Floats:
    if refine == 1:
        return z
    rows, columns = np.arange(z.shape[0]), np.arange(z.shape[1])
    fine_rows = np.linspace(0, rows[-1], rows[-1] * refine + 1)
    fine_columns = np.linspace(0, columns[-1], columns[-1] * refine + 1)
    spline = RectBivariateSpline(rows, columns, z)
    return np.asarray(spline(fine_rows, fine_columns), dtype=float)
