"""A camera above the floor: from a frame to the body's line in the world.

The floor maps to the image by one homography. The image shows the body's outline, which lies
as high as its axis; seen from a lens at height ``h`` above the foot ``f``, a point at height ``z``
covers the floor further out, at ``g = f + (p - f) h / (h - z)``, and that is undone.
"""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.body_detector import BodyDetector, Detection
from snakewalk.controller.capture.frame_status import FrameStatus
from snakewalk.controller.capture.image.silhouette import Polarity
from snakewalk.controller.localization.lens import Lens

_LEAST_AREA = 0.01  # of the image: four corners that span less fix no plane


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Where a pixel lies on the floor, and on a level plane above it."""

    floor_from_px: Floats
    """(3, 3) homography, pixels (x right, y down, whole at the centre of a pixel) to metres."""
    foot_m: Floats
    """(2,) floor below the lens."""
    height_m: float
    """Of the lens above the floor."""
    lens: Lens | None = None
    """Where it distorts, the homography is of pixels without distortion."""

    @classmethod
    def straight_down(
        cls, camera: CameraConfig, centre_m: tuple[float, float], lens: Lens | None = None
    ) -> Self:
        """Build the model of an upright pinhole camera above ``centre_m``."""
        scale = camera.field_width_m / camera.width_px
        c, s = scale * np.cos(camera.turn_rad), scale * np.sin(camera.turn_rad)
        x, y = 0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)
        floor = np.eye(3)
        floor[:2, :2] = [[c, s], [s, -c]]  # the image's y runs down
        floor[:2, 2] = centre_m[0] - (c * x + s * y), centre_m[1] - (s * x - c * y)
        return cls(floor, np.array(centre_m, dtype=float), camera.height_m, lens)

    @classmethod
    def from_corners(
        cls, camera: CameraConfig, centre_m: tuple[float, float], lens: Lens | None = None
    ) -> Self:
        """Build the model from four places that are known in the image and on the floor.

        Raises:
            InputError: none are given, or three of them lie on a line.

        """
        if camera.corners_px is None or camera.corners_m is None:
            raise InputError("camera: corners_px and corners_m are needed")
        px = np.array(camera.corners_px, dtype=np.float32)
        if lens is not None:
            px = lens.undistorted(px.astype(float)).astype(np.float32)
        floor = np.array(camera.corners_m, dtype=np.float32)
        for name, corners, whole in (
            ("corners_px", px, float(camera.width_px * camera.height_px)),
            ("corners_m", floor, float(np.ptp(floor, axis=0).prod())),
        ):
            if _least_triangle(corners) < _LEAST_AREA * whole or whole == 0.0:
                raise InputError(f"camera: {name}: three of the four places lie on a line")
        found = np.asarray(cv2.getPerspectiveTransform(px, floor), dtype=float)
        return cls(found, np.array(centre_m, dtype=float), camera.height_m, lens)

    def on_plane(self, points_px: Floats, z_m: float) -> Floats:
        """(..., 2) world places of pixels (..., 2) of what is ``z_m`` above the floor."""
        plain = points_px if self.lens is None else self.lens.undistorted(points_px)
        floor = _projected(self.floor_from_px, plain)
        return np.asarray(self.foot_m + (floor - self.foot_m) * (1.0 - z_m / self.height_m))

    def in_image(self, points_m: Floats, z_m: float) -> Floats:
        """(..., 2) pixels of world places (..., 2) that are ``z_m`` above the floor."""
        floor = self.foot_m + (points_m - self.foot_m) / (1.0 - z_m / self.height_m)
        back = np.asarray(np.linalg.inv(self.floor_from_px), dtype=float)
        plain = _projected(back, floor)
        return plain if self.lens is None else self.lens.distorted(plain)


@dataclass(frozen=True, slots=True)
class LineDetection:
    """The body's line in one frame."""

    time_s: float
    """When the image was taken."""
    line_m: Floats
    """(101, 2) axis of the body in the world from tip to tip, which end first is not known; NaN
    where the frame shows no whole body."""
    status: FrameStatus


@dataclass(frozen=True, slots=True)
class OverheadDetector:
    """Camera, empty floor and height of the body's axis; ``detect`` takes any frame."""

    model: CameraModel
    background: Image
    axis_height_m: float
    shade: float = 0.0
    """Part of the floor's light that the body's shadow may take: so much darker is still floor."""

    def detect(self, image: Image, time_s: float) -> LineDetection:
        """Find the body in one frame (H, W[, 3]).

        Raises:
            InputError: the frame is not as large as the background.

        """
        skeleton = self.detect_px(image).skeleton
        line = self.model.on_plane(skeleton.points_px, self.axis_height_m)
        return LineDetection(time_s, line, skeleton.status)

    def detect_px(self, image: Image) -> Detection:
        """Silhouette and skeleton of a frame, in pixels.

        Raises:
            InputError: the frame is not as large as the background.

        """
        floor = self.background
        if image.shape != floor.shape:
            sizes = " and ".join(f"{one.shape[1]} x {one.shape[0]}" for one in (image, floor))
            raise InputError(f"frame and background must be alike, they are {sizes} pixels")
        dark = cv2.convertScaleAbs(floor, alpha=1.0 - self.shade)
        brighter, darker = cv2.subtract(image, floor), cv2.subtract(dark, image)
        apart: Image = np.asarray(cv2.max(brighter, darker), dtype=np.uint8)
        return BodyDetector(np.zeros_like(apart), Polarity.BOTH, "given").detect(apart)


def _projected(matrix: Floats, points: Floats) -> Floats:
    x, y = points[..., 0], points[..., 1]
    moved = [row[0] * x + row[1] * y + row[2] for row in matrix]
    return np.stack([moved[0] / moved[2], moved[1] / moved[2]], axis=-1)


def _least_triangle(corners: NDArray[np.float32]) -> float:
    areas = []
    for out in range(4):
        a, b, c = np.delete(corners, out, axis=0).astype(float)
        (ux, uy), (vx, vy) = b - a, c - a
        areas.append(0.5 * abs(ux * vy - uy * vx))
    return float(min(areas))
