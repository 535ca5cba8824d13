"""Ground with detail by distance: tiles of a height field at several sample distances.

MuJoCo draws a height field in full. Here only tiles in view are drawn, each at the coarsest level
whose error is at most a few pixels. Skirts close the gaps between levels.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.sim.rendering.view_frustum import ViewFrustum

STEPS = (1, 2, 4, 8)
"""Samples of the field for one of a tile, finest level first."""
CELLS = 32
"""Cells of a tile along each side."""
MOST_PIXELS = 2.0
"""Largest error of a drawn tile, pixels (ours)."""
_UNSEEN = 5
"""Group of geoms that are not drawn."""


@dataclass(frozen=True, slots=True)
class TileMesh:
    """One level of a tile."""

    corners_m: Floats
    """(V, 3) corners of the mesh, m."""
    normals: Floats
    """(V, 3) unit normals of the ground at the corners."""
    uv: Floats
    """(V, 2) in the texture, whose first row has the largest y."""
    faces: Ints
    """(F, 3) counter-clockwise from above."""
    error_m: float
    """Largest vertical distance from the field."""


class GroundTiles:
    """The tiles of a field; ``add_to`` prepares a model."""

    def __init__(self, ground: HeightField) -> None:
        """Cut the field into tiles."""
        rows, columns = ground.z_m.shape
        starts = [(j, i) for j in range(0, rows - 1, CELLS) for i in range(0, columns - 1, CELLS)]
        self._tiles = [_tile(ground, j, i) for j, i in starts]
        finest = [levels[0].corners_m for levels in self._tiles]
        low = np.array([corners.min(axis=0) for corners in finest])
        high = np.array([corners.max(axis=0) for corners in finest])
        self._middle_m, self._radius_m = (
            0.5 * (low + high),
            0.5 * np.linalg.norm(high - low, axis=1),
        )
        self._geoms: Ints = np.zeros(0, dtype=np.int64)
        self._error_m = np.array([[level.error_m for level in levels] for levels in self._tiles])

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the tiles to an uncompiled model with the material ``ground``, which they replace."""
        spec.geom("ground").group = _UNSEEN
        for name, tile in self._named_tiles():
            spec.add_mesh(
                name=name,
                uservert=tile.corners_m.ravel(),
                usernormal=tile.normals.ravel(),
                usertexcoord=tile.uv.ravel(),
                userface=tile.faces.ravel(),
                userfacetexcoord=tile.faces.ravel(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                name=name,
                meshname=name,
                material="ground",
                contype=0,
                conaffinity=0,
                mass=0.0,
                group=_UNSEEN,
            )

    def choose(self, model: mujoco.MjModel, view: ViewFrustum) -> None:
        """Show the tiles in view; call it before the scene is updated."""
        away = np.linalg.norm(self._middle_m - view.eye_m, axis=1) - self._radius_m
        pixel_m = np.maximum(away, 0.0) * view.pixel_rad
        fits = self._error_m <= MOST_PIXELS * pixel_m[:, None]
        level = np.where(fits, np.arange(len(STEPS)), 0).max(axis=1)
        if not self._geoms.size:
            names = [model.geom(name).id for name, _ in self._named_tiles()]
            self._geoms = np.array(names).reshape(-1, len(STEPS))
        model.geom_group[self._geoms] = _UNSEEN
        shown = np.flatnonzero(view.touches(self._middle_m, self._radius_m))
        model.geom_group[self._geoms[shown, level[shown]]] = 0

    def _named_tiles(self) -> Iterator[tuple[str, TileMesh]]:
        for tile, levels in enumerate(self._tiles):
            for level, tile_level in enumerate(levels):
                yield f"tile{tile}-{level}", tile_level


def _tile(ground: HeightField, row: int, column: int) -> tuple[TileMesh, ...]:
    """Levels of a tile that begins at a sample."""
    bottom = min(row + CELLS, ground.z_m.shape[0] - 1)
    right = min(column + CELLS, ground.z_m.shape[1] - 1)
    meshes = []
    for step in STEPS:
        j = np.append(np.arange(row, bottom, step), bottom)
        i = np.append(np.arange(column, right, step), right)
        meshes.append((j, i, _error_m(ground, j, i)))
    skirt_m = 2.0 * max(error for _, _, error in meshes) + 0.02 * ground.spacing_m
    return tuple(_mesh(ground, j, i, error, skirt_m) for j, i, error in meshes)


def _error_m(ground: HeightField, j: Ints, i: Ints) -> float:
    """Largest height of a coarse tile over the samples below it, or below those above."""
    rows, columns = np.arange(j[0], j[-1] + 1), np.arange(i[0], i[-1] + 1)
    coarse = np.array([np.interp(columns, i, ground.z_m[row, i]) for row in j])
    fine = np.array([np.interp(rows, j, column) for column in coarse.T]).T
    return float(
        np.abs(fine - ground.z_m[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]).max()
    )


def _mesh(ground: HeightField, j: Ints, i: Ints, error_m: float, skirt_m: float) -> TileMesh:
    """Grid of samples (j, i), and a skirt that hangs from its border."""
    column, row = np.meshgrid(i, j)
    x, y = ground.x0_m + ground.spacing_m * column, ground.y0_m + ground.spacing_m * row
    top = np.stack([x, y, ground.z_m[row, column]], axis=-1).reshape(-1, 3)
    slope_y, slope_x = (np.gradient(ground.z_m, ground.spacing_m, axis=axis) for axis in (0, 1))
    normal = np.stack([-slope_x[row, column], -slope_y[row, column], np.ones(x.shape)], axis=-1)
    normal = (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).reshape(-1, 3)
    number = np.arange(top.shape[0]).reshape(len(j), len(i))
    first = number[:-1, :-1].ravel()
    a, b, c, d = first, first + 1, first + len(i) + 1, first + len(i)
    faces = [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    # around the border, counter-clockwise from above
    border = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    low = top[border] - [0.0, 0.0, skirt_m]
    lower_index = len(top) + np.arange(len(border))
    after = np.roll(border, -1)
    hung_after = np.roll(lower_index, -1)
    faces += [
        np.stack([border, lower_index, hung_after], 1),
        np.stack([border, hung_after, after], 1),
    ]
    corners = np.concatenate([top, low])
    wide, high = ground.size_m
    uv = np.column_stack(
        [(corners[:, 0] - ground.x0_m) / wide, 1.0 - (corners[:, 1] - ground.y0_m) / high]
    )
    return TileMesh(
        corners, np.concatenate([normal, normal[border]]), uv, np.concatenate(faces), error_m
    )
