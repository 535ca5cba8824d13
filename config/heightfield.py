"""The height field: elevation over a regular grid in the world's horizontal plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bools, Floats


@dataclass(frozen=True, slots=True)
class HeightField:
    """Elevation ``z_m[row, column]`` at ``x0_m + column * spacing_m, y0_m + row * spacing_m``.

    Between samples the surface is two triangles a cell, split from the low-x-low-y corner to the
    high one, as MuJoCo splits it, so that planner, ground step and physics see the same ground.
    """

    z_m: Floats
    """(rows, columns) elevation, m; row 0 has the smallest y."""
    spacing_m: float
    x0_m: float
    y0_m: float

    def __post_init__(self) -> None:
        if self.z_m.ndim != 2 or min(self.z_m.shape) < 2 or not np.isfinite(self.z_m).all():
            raise ValueError("z_m must be a finite (rows >= 2, columns >= 2) array")
        self.z_m.setflags(write=False)

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent in x and in y, m."""
        rows, columns = self.z_m.shape
        return (columns - 1) * self.spacing_m, (rows - 1) * self.spacing_m

    def contains(self, x_m: ArrayLike, y_m: ArrayLike) -> Bools:
        """Whether points lie on the field."""
        x, y = np.asarray(x_m, float), np.asarray(y_m, float)
        w, h = self.size_m
        inside = (x >= self.x0_m) & (x <= self.x0_m + w) & (y >= self.y0_m) & (y <= self.y0_m + h)
        return np.asarray(inside)

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
        lower = fu >= fv  # the triangle that holds the (high x, low y) corner
        third = self.z_m.take(corner + np.where(lower, 1, columns))
        first, second = third - z00, z11 - third
        gx, gy = np.where(lower, first, second), np.where(lower, second, first)
        return z00 + gx * fu + gy * fv, gx / self.spacing_m, gy / self.spacing_m
