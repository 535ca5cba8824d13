"""Footprint: slopes under a body that follows a path, and the distance to steep ground.

A bending body covers a strip about half its length wide. A slope across the path makes it roll or
slide; a slope along it stops it. The path alone shows neither: a valley is level along its bottom.
"""

import numpy as np
from scipy.ndimage import distance_transform_edt

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.relief import fitted_gradient, interpolated, windowed_mean


class Footprint:
    """Slopes in a disc of diameter ``footprint_m``; exact on samples, bilinear between them."""

    def __init__(self, ground: HeightField, config: PlannerConfig) -> None:
        self._ground = ground
        radius_m = config.footprint_m / 2.0
        x, y = fitted_gradient(ground, config.slope_window_m)
        squares = [windowed_mean(ground, a * b, radius_m) for a, b in ((x, x), (x, y), (y, y))]
        mean_x, mean_y = fitted_gradient(ground, radius_m)
        self._layers = np.stack([mean_x, mean_y, *squares], axis=-1)
        steep = np.hypot(mean_x, mean_y) > np.tan(config.climb_limit_rad)
        if ground.known is not None:
            steep |= ~ground.known
        self._nearness = np.zeros(ground.z_m.shape)
        if steep.any():
            far_m = np.asarray(distance_transform_edt(~steep, sampling=ground.spacing_m), float)
            far = far_m / max(config.clearance_m, ground.spacing_m)
            self._nearness = np.maximum(1.0 - far, 0.0) ** 2

    @property
    def layers(self) -> Floats:
        """(rows, columns, 6) slopes x, y, their mean squares xx, xy, yy, and nearness.

        Nearness is 1 on ground that is unknown or steeper than the climb limit (under the whole
        footprint), and falls to 0 over the clearance.
        """
        return np.concatenate([self._layers, self._nearness[..., None]], axis=-1)

    def slope_rad(self, points_m: Floats) -> Floats:
        """Inclination (...) of the plane fitted to the footprint at points (..., 2)."""
        x, y = np.moveaxis(points_m, -1, 0)
        layers = interpolated(self._ground, self._layers, x, y)
        return np.asarray(np.arctan(np.hypot(layers[..., 0], layers[..., 1])))

    def slopes(self, points_m: Floats, direction: Floats) -> Floats:
        """Tangents (2, ...) of the slope up along a direction, and of the RMS slope across it.

        The slope up is that of the plane fitted to the footprint. The slope across is a root mean
        square, so that the two sides of a valley do not cancel.

        Args:
            points_m: (..., 2) in the world.
            direction: (..., 2) unit vectors of travel.

        """
        layers = interpolated(self._ground, self._layers, *np.moveaxis(points_m, -1, 0))
        gx, gy, xx, xy, yy = np.moveaxis(layers, -1, 0)
        dx, dy = np.moveaxis(direction, -1, 0)
        across = xx * dy**2 - 2.0 * xy * dx * dy + yy * dx**2
        return np.stack([gx * dx + gy * dy, np.sqrt(np.maximum(across, 0.0))])
