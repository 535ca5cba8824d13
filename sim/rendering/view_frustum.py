"""View of a camera without roll: its axes, and the bodies in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bools, Floats


@dataclass(frozen=True, slots=True)
class ViewFrustum:
    """Eye, axes and opening of a camera."""

    eye_m: Floats
    """(3,) position of the camera, m."""
    axes: Floats
    """(3, 3) rows: forward, right, up."""
    half_tan: tuple[float, float]
    """Tangents of half the opening, across and up."""
    height_px: int

    @classmethod
    def orbit(
        cls,
        lookat_m: ArrayLike,
        distance_m: float,
        azimuth_deg: float,
        elevation_deg: float,
        *,
        fovy_deg: float,
        size_px: tuple[int, int],
    ) -> "ViewFrustum":
        """Look at a point from a distance, in a direction; below the horizon elevation is < 0."""
        axes = np.array(camera_axes(azimuth_deg, elevation_deg))
        up = float(np.tan(np.radians(0.5 * fovy_deg)))
        eye = np.asarray(lookat_m, float) - distance_m * axes[0]
        return cls(eye, axes, (up * size_px[0] / size_px[1], up), size_px[1])

    @property
    def pixel_rad(self) -> float:
        """Opening of a pixel."""
        return 2.0 * self.half_tan[1] / self.height_px

    def in_camera(self, points_m: Floats) -> Floats:
        """(3, N) depth and offsets to the right and upwards of points (N, 3)."""
        return self.axes @ (points_m - self.eye_m).T

    def touches(self, centre_m: Floats, radius_m: Floats) -> Bools:
        """(N,) whether spheres with centres (N, 3) and radii (N,) touch the view."""
        depth, *offsets = self.in_camera(centre_m)
        is_visible = depth > -radius_m
        for offset, tangent in zip(offsets, self.half_tan, strict=True):
            is_visible &= np.abs(offset) <= tangent * depth + radius_m * np.hypot(1.0, tangent)
        return np.asarray(is_visible)


def camera_axes(azimuth_deg: ArrayLike, elevation_deg: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Directions (..., 3) ahead of cameras, to their right and upwards, of angles (...)."""
    turn = np.radians(azimuth_deg)
    rise = np.radians(elevation_deg)
    level = np.cos(rise)
    ahead = np.stack([level * np.cos(turn), level * np.sin(turn), np.sin(rise)], axis=-1)
    right = np.stack([np.sin(turn), -np.cos(turn), np.zeros_like(turn)], axis=-1)
    return ahead, right, np.cross(right, ahead)
