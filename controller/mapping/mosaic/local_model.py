"""Local model of a position: points, colours and valid region of a stereo pair ([KP] 3.2)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from snakewalk.controller.mapping.stereo_ground import DISPARITY_ERROR_PX, disparities

LEAST_DISPARITY_PX = 2.0
"""Below it a depth is uncertain by 15 % or more and the pixel is a hole (ours)."""
_WINDOW_PX = 7
_LEAST_SPREAD = 2.0
"""Variance of the grey levels of a window that shows something (ours)."""
LARGEST_STEP = 0.08
"""Relative difference of depth between neighbours that belong to one surface (ours)."""


@dataclass(frozen=True)
class LocalModel:
    """Maps ``X, Y, Z`` and ``I`` of a picture over its valid region.

    Camera axes: x to the right, y down, z forward.
    """

    points_m: Floats
    """(H, W, 3) points in the camera's axes; NaN outside of the valid region."""
    image: Image
    """(H, W, 3) colours."""
    camera: Floats
    """(3, 3) camera matrix, pixels."""
    baseline_m: float

    @classmethod
    def of_pair(cls, pair: RectifiedPair, count: int) -> Self:
        """Return the model of a rectified pair with three channels.

        ``count`` is the number of disparities, from that of a point at infinity.

        Raises:
            InputError: fewer than a hundredth of the pixels match.

        """
        disparity = disparities(pair, count)
        disparity[_has_no_texture(pair.left)] = np.nan
        with np.errstate(invalid="ignore"):
            disparity[disparity + pair.offset_px < LEAST_DISPARITY_PX] = np.nan
        if np.isfinite(disparity).mean() < 0.01:
            raise InputError(
                "stereo: fewer than 1 % of the pixels match between left and right picture; "
                "check the pictures, the calibration and `disparities`"
            )
        points_m = pair.points_m(disparity) @ pair.turned.T  # in the axes of the rectified picture
        f, (u, v) = pair.focal_px, pair.centre_px
        camera = np.array([[f, 0.0, u], [0.0, f, v], [0.0, 0.0, 1.0]])
        return cls(np.ascontiguousarray(points_m), pair.left, camera, pair.baseline_m)

    @property
    def valid(self) -> Bools:
        """(H, W) the valid region of the maps."""
        return np.isfinite(self.points_m[..., 2])

    @cached_property
    def cells(self) -> Bools:
        """(H - 1, W - 1) grid cells whose four corners belong to one surface."""
        return cells(self.points_m)

    @property
    def error_m(self) -> Floats:
        """(H, W) expected errors of the points; NaN outside the valid region."""
        distance = np.linalg.norm(self.points_m, axis=-1)
        per_m = DISPARITY_ERROR_PX / (self.camera[0, 0] * self.baseline_m)
        return np.asarray(distance * self.points_m[..., 2] * per_m)

    def near(self, error_m: float) -> Bools:
        """(H, W) points with an expected error of at most ``error_m``."""
        with np.errstate(invalid="ignore"):
            return self.error_m <= error_m


def _has_no_texture(image: Image) -> Bools:
    """(H, W) pixels of a region without texture, such as the sky.

    A matcher continues its border's depths into it.
    """
    grey = np.asarray(image, dtype=np.float32).mean(axis=2)
    window = (_WINDOW_PX, _WINDOW_PX)
    spread = cv2.blur(grey * grey, window) - cv2.blur(grey, window) ** 2
    plain = (spread < _LEAST_SPREAD).astype(np.uint8)
    return cv2.dilate(plain, np.ones(window, np.uint8)) > 0


def project(camera: Floats, points_m: Floats) -> Floats:
    """(..., 2) pixels of points (..., 3) in a camera's axes; NaN behind the camera."""
    with np.errstate(invalid="ignore", divide="ignore"):
        depth = np.where(points_m[..., 2] > 1e-6, points_m[..., 2], np.nan)
        u = camera[0, 0] * points_m[..., 0] / depth + camera[0, 2]
        v = camera[1, 1] * points_m[..., 1] / depth + camera[1, 2]
    return np.stack([u, v], axis=-1)


def sampled(image: NDArray[Any], places_px: Floats) -> Floats:
    """(H, W, k) bilinear samples of an image at columns and rows (H, W, 2); NaN outside."""
    map_px = np.nan_to_num(places_px, nan=-1e4).astype(np.float32)
    return np.asarray(
        cv2.remap(
            image,
            map_px[..., 0],
            map_px[..., 1],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(np.nan,) * 4,
        )
    )


def moved(points_m: Floats, motion: Floats) -> Floats:
    """Points (..., 3) after a motion (3, 4) to the axes of another position."""
    return points_m @ motion[:, :3].T + motion[:, 3]


def joined(depth_m: Floats, axis: int) -> Bools:
    """Whether neighbours along an axis of a depth map belong to one surface.

    The result is one shorter along the axis, and False outside the valid region.
    """
    near_m, two = (
        np.moveaxis(depth_m, axis, 0)[part] for part in (slice(None, -1), slice(1, None))
    )
    with np.errstate(invalid="ignore"):
        together = np.abs(near_m - two) <= LARGEST_STEP * np.minimum(near_m, two)
    return np.moveaxis(together, 0, axis)


def cells(points_m: Floats) -> Bools:
    """(H - 1, W - 1) grid cells whose four corners belong to one surface."""
    depth = points_m[..., 2]
    along, across = joined(depth, 1), joined(depth, 0)
    return along[:-1] & along[1:] & across[:, :-1] & across[:, 1:]
