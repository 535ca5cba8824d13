"""Growing map: heights of a fixed area, from one stereo pair after the other.

Unseen samples stay unknown. If a pair contradicts the map, the height with the smaller expected
error counts.
"""

from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.terrain.elevation_map import filled, opened

_LEAST_ERROR_M = 0.002
"""Least error of a sample, however often it was seen (ours): errors of the pose are common to its
points."""
_CONTRADICTS = 3.0
"""Standard errors between two heights that are not of the same ground (ours)."""
_LEAST_POINTS = 2
"""Least points of a picture in a sample's square, to count."""
_SMALL_HOLE_M = 0.12
"""Width of a hole that counts as known (ours): less than twice a body."""
_SMOOTH_M = 0.4
"""Distance from the seen places within which the filled surface is as fine as the map."""
_COARSE = 5
"""Samples, along a side, of the map for one of the surface that is filled in farther off."""


class GrowingMap:
    """Heights on a grid with their expected errors."""

    def __init__(
        self, x0_m: float, y0_m: float, size_m: tuple[float, float], spacing_m: float
    ) -> None:
        """Start with an unknown area."""
        self.spacing_m, self.x0_m, self.y0_m = spacing_m, x0_m, y0_m
        columns, rows = (int(np.ceil(side / spacing_m - 1e-9)) + 1 for side in size_m)
        self.z_m = np.empty((rows, columns))
        """(rows, columns) heights, row 0 with the smallest y; NaN if unseen."""
        self.error_m = np.empty((rows, columns))
        """(rows, columns) expected."""
        self.first_s = np.empty((rows, columns))
        """(rows, columns) time of the first picture that showed a sample."""
        self._touched_m = np.empty((rows, columns))
        self.pictures = 0
        """Number of pictures that were added so far."""
        self.clear()

    @classmethod
    def over(cls, ground: HeightField, spacing_m: float) -> "GrowingMap":
        """Return an empty map of the area of a height field."""
        return cls(ground.x0_m, ground.y0_m, ground.size_m, spacing_m)

    def clear(self) -> None:
        """Forget everything."""
        self.z_m[:] = self.first_s[:] = self._touched_m[:] = np.nan
        self.error_m[:] = np.inf
        self.pictures = 0

    @property
    def known(self) -> Bools:
        """(rows, columns) whether a sample was seen."""
        return np.isfinite(self.z_m)

    def is_known(self, x_m: float, y_m: float) -> bool:
        """Whether the sample of a place was seen."""
        cell, inside = self._cells(np.array([[x_m, y_m, 0.0]]))
        return bool(inside[0] and np.isfinite(self.z_m.ravel()[cell[0]]))

    def errors_m(self, ground: HeightField) -> Floats:
        """(k,) height errors of the seen samples against the true ground."""
        row, column = np.nonzero(self.known)
        x, y = self.x0_m + column * self.spacing_m, self.y0_m + row * self.spacing_m
        return self.z_m[row, column] - ground.elevation_m(x, y)

    def add(self, points_m: Floats, error_m: Floats, time_s: float) -> None:
        """Add the points of one pair of pictures.

        Args:
            points_m: (n, 3) in the world.
            error_m: (n,) expected error of each.
            time_s: time of the pictures.

        """
        self.pictures += 1
        cell, inside = self._cells(points_m)
        cell = cell[inside]
        z_m = points_m[inside, 2]
        error_m = error_m[inside]
        order = np.lexsort((z_m, cell))
        cell = cell[order]
        z_m = z_m[order]
        error_m = error_m[order]
        cells, first, count = np.unique(cell, return_index=True, return_counts=True)
        enough = count >= _LEAST_POINTS
        cells = cells[enough]
        middle = (first + (count - 1) // 2)[enough]
        self._fuse(cells, z_m[middle], np.maximum(error_m[middle], _LEAST_ERROR_M), time_s)

    def touch(self, points_m: Floats) -> None:
        """Store points (n, 3) of the ground that the body lies on.

        They shape the filled surface but stay unknown, because a link may hang over a hollow.
        """
        cell, inside = self._cells(points_m)
        self._touched_m.ravel()[cell[inside]] = points_m[inside, 2]

    def height_field(self) -> HeightField | None:
        """Return the map with holes filled but unknown; None while nothing is known.

        The filled surface is coarser far from seen samples.
        """
        is_known_now = self.known
        if not is_known_now.any():
            return None
        z_m = np.where(is_known_now, self.z_m, self._touched_m)
        holes = np.isnan(z_m)
        far_m = distance_transform_edt(holes, sampling=self.spacing_m)
        z_m[holes] = _coarsely_filled(z_m)[holes]
        trusted = is_known_now | ~opened(~is_known_now, 0.5 * _SMALL_HOLE_M / self.spacing_m)
        smooth = holes & (far_m <= _SMOOTH_M)
        return HeightField(filled(z_m, smooth), self.spacing_m, self.x0_m, self.y0_m, trusted)

    def write(self, file: Path) -> None:
        """Write a map file with heights, expected errors and times.

        Without any seen sample, all heights are 0 and unknown.
        """
        ground = self.height_field()
        z_m = np.zeros(self.z_m.shape) if ground is None else ground.z_m
        with file.open("wb") as stream:
            np.savez_compressed(
                stream,
                z_m=z_m.astype(np.float32),
                known=self.known,
                spacing_m=np.float64(self.spacing_m),
                x0_m=np.float64(self.x0_m),
                y0_m=np.float64(self.y0_m),
                error_m=self.error_m.astype(np.float32),
                first_s=self.first_s.astype(np.float32),
            )

    def _cells(self, points_m: Floats) -> tuple[Indices, Bools]:
        """Sample numbers of points (n, 3), and which points lie in the area."""
        rows, columns = self.z_m.shape
        x, y = np.rint((points_m[:, :2] - [self.x0_m, self.y0_m]) / self.spacing_m).T.astype(int)
        inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
        return y * columns + x, inside

    def _fuse(self, cells: Indices, z_m: Floats, error_m: Floats, time_s: float) -> None:
        """Merge heights with the existing ones by their expected errors."""
        before_m, was_m = self.z_m.ravel()[cells], self.error_m.ravel()[cells]
        new = np.isnan(before_m)
        with np.errstate(invalid="ignore"):
            other = ~new & (np.abs(z_m - before_m) > _CONTRADICTS * np.hypot(error_m, was_m))
        weight = error_m**-2.0
        was = was_m**-2.0  # 0 for a new sample
        joined_m = (weight * z_m + was * np.nan_to_num(before_m)) / (weight + was)
        joined_error_m = np.maximum((weight + was) ** -0.5, _LEAST_ERROR_M)
        nearer = other & (error_m < was_m)
        kept = other & ~nearer
        self.z_m.ravel()[cells] = np.where(kept, before_m, np.where(nearer, z_m, joined_m))
        self.error_m.ravel()[cells] = np.where(
            kept, was_m, np.where(nearer, error_m, joined_error_m)
        )
        self.first_s.ravel()[cells[new]] = time_s


def _coarsely_filled(z_m: Floats) -> Floats:
    """Fill (rows, columns) everywhere from the known heights, by means of squares."""
    rows, columns = z_m.shape
    more = -rows % _COARSE, -columns % _COARSE
    squares = np.pad(z_m, ((0, more[0]), (0, more[1])), constant_values=np.nan)
    squares = squares.reshape(-(-rows // _COARSE), _COARSE, -1, _COARSE)
    is_filled = np.isfinite(squares)
    count = is_filled.sum(axis=(1, 3))
    mean_m = np.where(is_filled, squares, 0.0).sum(axis=(1, 3)) / np.maximum(count, 1)
    coarse_m = filled(mean_m, count == 0) if (count == 0).any() else mean_m
    axes_cells = [(np.arange(n) - 0.5 * (_COARSE - 1)) / _COARSE for n in (rows, columns)]
    places = np.meshgrid(*axes_cells, indexing="ij")
    return map_coordinates(coarse_m, places, order=1, mode="nearest")
