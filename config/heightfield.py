"""The height field: elevation over a regular horizontal grid; a map's file.

A map's file is an ``.npz`` with ``z_m`` (rows, columns), row 0 with the smallest y, ``known`` of
the same shape, and the numbers ``spacing_m``, ``x0_m``, ``y0_m``. Optional: ``colour`` (rows,
columns, 3) for pictures.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Bools, Floats, Image, Ints
from snakewalk.config.errors import InputError

MOST_SAMPLES = 4_000_000
"""Limit of a map (ours): planner and simulator hold several arrays of its size."""
_NUMBERS = ("spacing_m", "x0_m", "y0_m")


@dataclass(frozen=True, slots=True)
class HeightField:
    """Elevation ``z_m[row, column]`` at ``x0_m + column * spacing_m, y0_m + row * spacing_m``.

    A cell is two triangles, split from the low-x-low-y corner to the high one as in MuJoCo, so
    planner, ground step and physics use the same ground.
    """

    z_m: Floats
    """(rows, columns) elevation, m; row 0 has the smallest y."""
    spacing_m: float
    x0_m: float
    y0_m: float
    known: Bools | None = None
    """(rows, columns) whether a sample was measured; elsewhere ``z_m`` is filled in, and no path
    leads there. None: all were."""
    colour: Image | None = None
    """(rows, columns, 3) colour of each sample, red first; None: coloured by height."""

    def __post_init__(self) -> None:
        if self.z_m.ndim != 2 or min(self.z_m.shape) < 2 or not np.isfinite(self.z_m).all():
            raise ValueError("z_m must be a finite (rows >= 2, columns >= 2) array")
        if self.known is not None:
            if self.known.shape != self.z_m.shape or self.known.dtype != bool:
                raise ValueError("known must be booleans of the shape of z_m")
            self.known.setflags(write=False)
        if self.colour is not None:
            if self.colour.shape != (*self.z_m.shape, 3) or self.colour.dtype != np.uint8:
                raise ValueError("colour must be bytes (rows, columns, 3) of the shape of z_m")
            self.colour.setflags(write=False)
        self.z_m.setflags(write=False)

    @property
    def axes_m(self) -> tuple[Floats, Floats]:
        """Places of the samples: x (columns,) and y (rows,)."""
        rows, columns = self.z_m.shape
        return (
            self.x0_m + np.arange(columns, dtype=np.float64) * self.spacing_m,
            self.y0_m + np.arange(rows, dtype=np.float64) * self.spacing_m,
        )

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent in x and in y, m."""
        rows, columns = self.z_m.shape
        return (columns - 1) * self.spacing_m, (rows - 1) * self.spacing_m

    @property
    def middle_m(self) -> Floats:
        """(2,) place in the middle of the field."""
        return np.array([self.x0_m, self.y0_m]) + 0.5 * np.array(self.size_m)

    def contains(self, x_m: ArrayLike, y_m: ArrayLike, margin_m: float = 0.0) -> Bools:
        """Whether points are on the field, at least ``margin_m`` from its border."""
        x, y = np.asarray(x_m, float), np.asarray(y_m, float)
        w, h = self.size_m
        inside = np.minimum(x - self.x0_m, self.x0_m + w - x) >= margin_m
        return inside & (np.minimum(y - self.y0_m, self.y0_m + h - y) >= margin_m)

    def elevation_m(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Elevation at points (clamped to the border), m; shape of the inputs."""
        return self.plane(x_m, y_m)[0]

    def gradient(self, x_m: ArrayLike, y_m: ArrayLike) -> tuple[Floats, Floats]:
        """``dz/dx, dz/dy`` of the triangle under each point."""
        _, gx, gy = self.plane(x_m, y_m)
        return gx, gy

    def slope_rad(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Inclination of the triangle under each point, rad."""
        gx, gy = self.gradient(x_m, y_m)
        return np.arctan(np.hypot(gx, gy))

    def plane(self, x_m: ArrayLike, y_m: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Elevation (m) and ``dz/dx, dz/dy`` in one look-up, each of the inputs' shape."""
        rows, columns = self.z_m.shape
        u = np.clip((np.asarray(x_m, float) - self.x0_m) / self.spacing_m, 0.0, columns - 1.0)
        v = np.clip((np.asarray(y_m, float) - self.y0_m) / self.spacing_m, 0.0, rows - 1.0)
        i = np.minimum(u.astype(np.intp), columns - 2)
        j = np.minimum(v.astype(np.intp), rows - 2)
        fu, fv = u - i, v - j
        corner = j * columns + i
        z00, z11 = self.z_m.take(corner), self.z_m.take(corner + (columns + 1))
        lower = fu >= fv  # the triangle with the (high x, low y) corner
        third = self.z_m.take(corner + np.where(lower, 1, columns))
        first = third - z00
        second = z11 - third
        gx, gy = np.where(lower, first, second), np.where(lower, second, first)
        return z00 + gx * fu + gy * fv, gx / self.spacing_m, gy / self.spacing_m


def surface(field: HeightField) -> tuple[Floats, Ints]:
    """Corners (n, 3), m, and triangles (k, 3) of a field's surface."""
    corner = np.arange(field.z_m.size).reshape(field.z_m.shape)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    faces = np.moveaxis(np.array([[a, b, c], [a, c, d]]), 1, -1).reshape(-1, 3)
    return np.dstack([*np.meshgrid(*field.axes_m), field.z_m]).reshape(-1, 3), faces


def write_map(file: Path, ground: HeightField) -> None:
    """Write a height field as a map's file."""
    is_known = np.ones(ground.z_m.shape, bool) if ground.known is None else ground.known
    colour: dict[str, Any] = {} if ground.colour is None else {"colour": ground.colour}
    with file.open("wb") as stream:
        np.savez_compressed(
            stream,
            z_m=ground.z_m.astype(np.float32),
            known=is_known,
            spacing_m=np.float64(ground.spacing_m),
            x0_m=np.float64(ground.x0_m),
            y0_m=np.float64(ground.y0_m),
            **colour,
        )


def read_map(file: Path) -> HeightField:
    """Read a map's file.

    Raises:
        InputError: it cannot be read, lacks an array, or is not a map.

    """
    try:
        arrays, _ = read_arrays(file, {"z_m", "known", "colour", *_NUMBERS})
        z_m = arrays["z_m"].astype(float)
        is_known = arrays["known"]
        spacing_m, x0_m, y0_m = (float(arrays[name]) for name in _NUMBERS)
        if not (0.0 < spacing_m < np.inf and np.isfinite([x0_m, y0_m]).all()):
            raise ValueError("spacing_m must be above 0, x0_m and y0_m must be finite")
        if z_m.size > MOST_SAMPLES:
            raise ValueError(f"holds {z_m.size} samples; {MOST_SAMPLES} are the most")
        return HeightField(z_m, spacing_m, x0_m, y0_m, is_known, arrays.get("colour"))
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    except KeyError as error:
        raise InputError(f"{file}: holds no array named {error}") from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{file}: is no map: {error}") from None
