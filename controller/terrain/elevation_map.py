"""Elevation map: measured heights on a regular grid, NaN where nothing was measured.

It is built from points, triangles or rasters, and gives a height field for planner and simulator.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
import scipy  # scipy.interpolate loads when it is first used
from scipy.ndimage import distance_transform_edt, map_coordinates
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import cg

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import MOST_SAMPLES, HeightField
from snakewalk.drivers.compiling import compiled, readonly_array

CellHeight = Literal["lowest", "median", "highest"]
"""Which of the points in a cell is its height."""
_ROUNDS = 2000
"""Steps of the solver that fills holes, at most: of holes a thousand samples wide."""
_QUANTILE = {"lowest": 0.0, "median": 0.5, "highest": 1.0}


@dataclass(frozen=True, slots=True)
class ElevationMap:
    """Heights ``z_m[row, column]`` at ``x0_m + column * spacing_m, y0_m + row * spacing_m``."""

    z_m: Floats
    """(rows, columns) heights; NaN where nothing was measured; row 0 has the smallest y."""
    spacing_m: float
    x0_m: float
    y0_m: float

    @classmethod
    def of_points(
        cls, points_m: Floats, spacing_m: float, height: CellHeight = "median", least: int = 1
    ) -> Self:
        """Grid the points (n, 3): a sample represents the square of one spacing around it.

        Args:
            points_m: x, y, z.
            spacing_m: between samples.
            height: which of a square's points counts.
            least: squares with fewer points are unknown.

        Raises:
            InputError: no points, too many samples, or fewer than two in a row or column.

        """
        if len(points_m) == 0:
            raise InputError("map: no point is left to make it of")
        low = points_m[:, :2].min(axis=0)
        columns, rows = _shape(points_m[:, :2].max(axis=0) - low, spacing_m)
        x, y = np.rint((points_m[:, :2] - low) / spacing_m).astype(np.int64).T
        cell = y * columns + x
        order = np.lexsort((points_m[:, 2], cell))
        cell = cell[order]
        z_m = points_m[order, 2]
        cells, first, count = np.unique(cell, return_index=True, return_counts=True)
        chosen = first + _QUANTILE[height] * (count - 1)
        lower, upper = np.floor(chosen).astype(np.int64), np.ceil(chosen).astype(np.int64)
        heights_m = np.full(rows * columns, np.nan)
        heights_m[cells] = np.where(count >= least, 0.5 * (z_m[lower] + z_m[upper]), np.nan)
        return cls(heights_m.reshape(rows, columns), spacing_m, float(low[0]), float(low[1]))

    @classmethod
    def of_triangles(
        cls, vertices_m: Floats, faces: Ints, low_m: Floats, high_m: Floats, spacing_m: float
    ) -> Self:
        """Set each sample to the highest surface of a mesh.

        Args:
            vertices_m: (n, 3).
            faces: (k, 3) indices of vertices.
            low_m: (2,) smallest x and y of the map.
            high_m: (2,) largest.
            spacing_m: between samples.

        Raises:
            InputError: too many samples, or fewer than two in a row or column.

        """
        columns, rows = _shape(high_m - low_m, spacing_m)
        z_m = np.full((rows, columns), -np.inf)
        points = np.array(vertices_m, dtype=float)
        points[:, :2] = (points[:, :2] - low_m) / spacing_m
        _rasterise(points, np.ascontiguousarray(faces, dtype=np.int64), z_m)
        z_m[np.isinf(z_m)] = np.nan
        return cls(z_m, spacing_m, float(low_m[0]), float(low_m[1]))

    @classmethod
    def of_raster(cls, z_m: Floats, dx_m: float, dy_m: float, spacing_m: float) -> Self:
        """Resample a raster; its first sample is (0, 0).

        Finer samples lie on a cubic surface through the raster, and are known if the four around
        them are. Coarser samples are medians.

        Args:
            z_m: (rows, columns), row 0 with the smallest y; NaN is unknown.
            dx_m: between columns.
            dy_m: between rows.
            spacing_m: between the samples of the map.

        Raises:
            InputError: nothing is known, or the map's samples are too many or too few.

        """
        is_known = np.isfinite(z_m)
        if not is_known.any():
            raise InputError("map: no cell holds a height")
        if math.isclose(dx_m, dy_m) and math.isclose(dx_m, spacing_m):
            return cls(z_m, spacing_m, 0.0, 0.0)
        if spacing_m > max(dx_m, dy_m):
            row, column = np.nonzero(is_known)
            points = np.stack([column * dx_m, row * dy_m, z_m[is_known]], axis=-1)
            return cls.of_points(points, spacing_m)
        rows, columns = z_m.shape
        size = ((columns - 1) * dx_m, (rows - 1) * dy_m)
        wide, high = _shape(np.array(size), spacing_m, floor=True)
        x = np.arange(wide) * spacing_m / dx_m
        y = np.arange(high) * spacing_m / dy_m
        filled_m = z_m if is_known.all() else filled(z_m, ~is_known)
        order = min(3, rows - 1), min(3, columns - 1)
        spline = scipy.interpolate.RectBivariateSpline(
            np.arange(rows), np.arange(columns), filled_m, kx=order[0], ky=order[1]
        )
        fine = np.asarray(spline(y, x), dtype=float)
        places = np.stack(np.meshgrid(y, x, indexing="ij"))
        share = map_coordinates(is_known.astype(float), places, order=1, mode="nearest")
        return cls(np.where(share > 1.0 - 1e-9, fine, np.nan), spacing_m, 0.0, 0.0)

    @property
    def known(self) -> Bools:
        """(rows, columns) whether a height was measured."""
        return np.isfinite(self.z_m)

    def centred(self) -> Self:
        """Return the map with its middle at (0, 0)."""
        rows, columns = self.z_m.shape
        half = 0.5 * self.spacing_m
        return replace(self, x0_m=-(columns - 1) * half, y0_m=-(rows - 1) * half)

    def height_field(self, fill_m: float = 0.0) -> HeightField:
        """Return the height field: lowest point at 0, holes filled but unknown.

        Args:
            fill_m: a hole narrower than a disc of this width counts as known.

        Raises:
            InputError: nothing is known.

        """
        is_known = self.known
        if not is_known.any():
            raise InputError("map: no cell holds a height")
        z_m = self.z_m if is_known.all() else filled(self.z_m, ~is_known)
        trusted = is_known
        if fill_m > 0.0:
            trusted = is_known | ~opened(~is_known, 0.5 * fill_m / self.spacing_m)
        return HeightField(z_m - z_m.min(), self.spacing_m, self.x0_m, self.y0_m, trusted)


def filled(z_m: Floats, holes: Bools) -> Floats:
    """Fill holes with the smoothest surface: Laplace's equation, level towards the border.

    A plane with holes inside becomes the plane, to a thousandth of its relief.

    Args:
        z_m: (rows, columns); some are finite.
        holes: (rows, columns) samples to fill.

    """
    nearest = distance_transform_edt(holes, return_distances=False, return_indices=True)
    base = float(np.mean(z_m[~holes]))
    out = z_m[tuple(nearest)] - base
    system = LaplaceSystem.of(holes, ~holes, out[..., None])
    solved, _ = cg(
        system.matrix(), system.border_sum[:, 0], x0=out[holes], rtol=1e-6, maxiter=_ROUNDS
    )
    filled_m = np.array(z_m, dtype=float)
    filled_m[holes] = solved + base
    return filled_m


@dataclass(frozen=True, slots=True)
class LaplaceSystem:
    """Equations of n unknown samples of a grid: each is the mean of its neighbours."""

    border_count: Floats
    """(n,) number of neighbours with a given value."""
    border_sum: Floats
    """(n, k) sum of the values of these neighbours."""
    low: Ints
    """(m,) indices of unknown samples with an unknown neighbour."""
    high: Ints
    """(m,) indices of these neighbours."""

    @classmethod
    def of(cls, unknown: Bools, given: Bools, values: Floats) -> Self:
        """Return the equations for a grid (H, W) with values (H, W, k), read where given."""
        index = np.where(unknown, np.cumsum(unknown).reshape(unknown.shape) - 1, -1)
        count = int(unknown.sum())
        border_count = np.zeros(count)
        border_sum = np.zeros((count, values.shape[-1]))
        pairs = []
        for axis in (0, 1):
            cells = index.swapaxes(0, axis)
            is_given = given.swapaxes(0, axis)
            sides = values.swapaxes(0, axis)
            below, above = cells[:-1], cells[1:]
            for inner, neighbours in ((below, np.s_[1:]), (above, np.s_[:-1])):
                edge = (inner >= 0) & is_given[neighbours]
                np.add.at(border_count, inner[edge], 1.0)
                np.add.at(border_sum, inner[edge], sides[neighbours][edge])
            both = (below >= 0) & (above >= 0)
            pairs.append(np.stack([below[both], above[both]]))
        return cls(border_count, border_sum, *np.concatenate(pairs, axis=1))

    def matrix(self) -> csr_array:
        """Return the matrix (n, n) of the equations; a sample without neighbours has weight 1."""
        count = len(self.border_count)
        weight = self.border_count.copy()
        for end in (self.low, self.high):
            weight += np.bincount(end, minlength=count)
        weight[weight == 0.0] = 1.0
        diagonal = np.arange(count)
        return coo_array(
            (
                np.concatenate([weight, -np.ones(2 * len(self.low))]),
                (
                    np.concatenate([diagonal, self.low, self.high]),
                    np.concatenate([diagonal, self.high, self.low]),
                ),
            ),
        ).tocsr()


def opened(holes: Bools, radius: float) -> Bools:
    """Keep the parts of holes (rows, columns) that a disc of a radius, in samples, fits into.

    Beyond the border everything is a hole.
    """
    far = math.ceil(radius) + 1
    wide = np.pad(holes, far, constant_values=True)
    inner = distance_transform_edt(wide) > radius
    if not inner.any():
        return np.zeros_like(holes)
    back = distance_transform_edt(~inner) <= radius
    return (back & wide)[far:-far, far:-far]


def _shape(size_m: Floats, spacing_m: float, *, floor: bool = False) -> tuple[int, int]:
    cells = np.floor(size_m / spacing_m + 1e-9) if floor else np.rint(size_m / spacing_m)
    columns, rows = (int(count) + 1 for count in cells)
    if columns * rows > MOST_SAMPLES:
        enough = spacing_m * math.sqrt(columns * rows / MOST_SAMPLES)
        raise InputError(
            f"map: {columns} by {rows} samples {spacing_m:g} m apart are over {MOST_SAMPLES}; "
            f"use a spacing of {enough:.2g} m or more, or a smaller crop"
        )
    if min(columns, rows) < 2:
        raise InputError(
            f"map: {size_m[0]:.3g} m by {size_m[1]:.3g} m contain fewer than 2 by 2 samples "
            f"{spacing_m:g} m apart; use a smaller spacing or a larger scale"
        )
    return columns, rows


@compiled(
    f"void({readonly_array(dimensions=2, layout='C')},"
    f" {readonly_array('int64', dimensions=2, layout='C')}, float64[:, ::1])"
)
def _rasterise(vertices: Floats, faces: Ints, z_m: Floats) -> None:
    """Raise samples (rows, columns) to the triangles above them; x and y are in samples."""
    rows, columns = z_m.shape
    for f in range(len(faces)):
        ax, ay, az = vertices[faces[f, 0]]
        bx, by, bz = vertices[faces[f, 1]]
        cx, cy, cz = vertices[faces[f, 2]]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:  # vertical
            continue
        left = max(int(np.ceil(min(ax, bx, cx) - 1e-9)), 0)
        right = min(int(np.floor(max(ax, bx, cx) + 1e-9)), columns - 1)
        bottom = max(int(np.ceil(min(ay, by, cy) - 1e-9)), 0)
        top = min(int(np.floor(max(ay, by, cy) + 1e-9)), rows - 1)
        for row in range(bottom, top + 1):
            for column in range(left, right + 1):
                v = ((column - ax) * (cy - ay) - (cx - ax) * (row - ay)) / area
                w = ((bx - ax) * (row - ay) - (column - ax) * (by - ay)) / area
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    z = az + v * (bz - az) + w * (cz - az)
                    z_m[row, column] = max(z_m[row, column], z)
