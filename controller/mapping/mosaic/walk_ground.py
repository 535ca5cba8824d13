"""Ground of a walk: heights and colours of all models, with holes at unseen ground."""

from dataclasses import replace

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.mapping.mosaic.walk import StereoWalk
from snakewalk.controller.mapping.stereo_ground import CameraStand, fit_ground
from snakewalk.controller.terrain.elevation_map import ElevationMap

_LEAST_POINTS = 2
"""Least number of points in a known cell (ours)."""
_HOLE = (150, 150, 150)
"""Colour of unknown ground (ours)."""


def walk_ground(
    walk: StereoWalk,
    spacing_m: float,
    error_m: float,
    fill_m: float,
) -> HeightField:
    """Map the ground along a route; x is the first camera's direction of view.

    The origin is below this camera, whose stand is fitted to its points.

    Args:
        walk: models and poses of the positions.
        spacing_m: distance of samples.
        error_m: points with a larger expected error are dropped.
        fill_m: width of holes that count as known.

    Raises:
        InputError: no visible ground, or no point near enough for the error.

    """
    points = []
    colours = []
    for model, pose in zip(walk.models, walk.poses, strict=True):
        good = model.near(error_m)
        points.append(model.points_m[good] @ pose[:, :3].T + pose[:, 3])
        colours.append(model.image[good])
    stand = level_stand(walk, error_m)
    world = np.concatenate(points) @ stand.world_from_camera().T
    world[:, 2] += stand.height_m
    elevation_map = ElevationMap.of_points(world, spacing_m, "median", _LEAST_POINTS)
    field = elevation_map.height_field(fill_m)
    colour = _colours(elevation_map, world, np.concatenate(colours))
    return replace(field, colour=colour)


def level_stand(walk: StereoWalk, error_m: float) -> CameraStand:
    """Fit the stand of the first left camera to its points with an error of at most ``error_m``.

    Raises:
        InputError: no visible ground, or no point near enough for the error.

    """
    model = walk.models[0]
    good = model.near(error_m)
    if good.sum() < 100:
        raise InputError(
            f"the first position shows {good.sum()} points with an error of at most "
            f"{error_m:g} m; raise --error, or record the pictures from nearer"
        )
    return fit_ground(model.points_m[good], model.error_m[good])


def _colours(elevation_map: ElevationMap, points_m: Floats, colours: Floats | Image) -> Image:
    """(rows, columns, 3) mean colours of the points near each sample's surface."""
    rows, columns = elevation_map.z_m.shape
    place = points_m[:, :2] - [elevation_map.x0_m, elevation_map.y0_m]
    column, row = np.rint(place / elevation_map.spacing_m).astype(int).T
    near = np.abs(points_m[:, 2] - elevation_map.z_m[row, column]) <= elevation_map.spacing_m
    cell = (row * columns + column)[near]
    count = np.bincount(cell, minlength=rows * columns)
    sums = [np.bincount(cell, channel, rows * columns) for channel in colours[near].T.astype(float)]
    mean = np.stack(sums, axis=-1) / np.maximum(count, 1)[:, None]
    mean[count == 0] = _HOLE
    return np.rint(mean).astype(np.uint8).reshape(rows, columns, 3)
