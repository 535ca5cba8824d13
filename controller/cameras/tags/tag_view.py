"""A calibrated camera in any position: matrix, distortion, and pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import cv2
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.tags import FixedTag
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.tags.tag_detector import Corners
from snakewalk.controller.pose.sample import turned

_MISFIT_PX = 4.0
"""Largest error of fixed tags by which a camera's place is found (ours)."""


def square(side_m: float) -> Floats:
    """Corners (4, 3) of a tag in its own axes, in the detector's order."""
    half = 0.5 * side_m
    return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0]])


@dataclass(frozen=True, slots=True)
class TagView:
    """A pinhole camera; x is to the right, y down, z ahead."""

    lens: Lens
    place_m: Floats
    """(3,) of the lens in the world."""
    rotation: Floats
    """(3, 3) columns: axes of the camera in the world."""

    @classmethod
    def of(cls, camera: CameraConfig) -> Self:
        """Return the camera of a run; without ``place_m`` its place is NaN.

        Raises:
            InputError: the lens file cannot be read, or is of another size.

        """
        size = (camera.width_px, camera.height_px)
        if camera.lens is None:
            focal = camera.width_px * camera.height_m / camera.field_width_m
            middle = 0.5 * (np.array(size) - 1.0)
            matrix = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
            lens = Lens(size, matrix, np.zeros(5))
        else:
            lens = Lens.read(Path(camera.lens))
            if lens.size_px != size:
                raise InputError(
                    f"{camera.lens}: is of pictures of {lens.size_px[0]} x {lens.size_px[1]} "
                    f"pixels, the camera has {size[0]} x {size[1]}; calibrate in that size"
                )
        if camera.place_m is None or camera.aim_m is None:
            return cls(lens, np.full(3, np.nan), np.full((3, 3), np.nan))
        return cls(lens, *_aimed_axes(camera))

    @property
    def is_placed(self) -> bool:
        """Whether the camera's place is known."""
        return bool(np.isfinite(self.place_m).all())

    def pixels(self, points_m: Floats) -> Floats:
        """Pixels, with distortion, of world points (..., 3)."""
        in_camera_m = (points_m - self.place_m) @ self.rotation
        flat = np.ascontiguousarray(in_camera_m.reshape(-1, 3))
        none = np.zeros(3)
        projected, _ = cv2.projectPoints(flat, none, none, self.lens.matrix, self.lens.distortion)
        return np.asarray(projected, dtype=float).reshape(*points_m.shape[:-1], 2)

    def placed_by(self, corners_by_tag: Corners, fixed: Sequence[FixedTag], side_m: float) -> Self:
        """Return the camera placed by fixed tags.

        Raises:
            InputError: no fixed tag is seen, or their places contradict the picture.

        """
        tags = [tag for tag in fixed if tag.id in corners_by_tag]
        if not tags:
            numbers = ", ".join(str(tag.id) for tag in fixed)
            raise InputError(f"camera.fixed_tags: none is in the picture; show tag {numbers}")
        corners = np.concatenate(
            [
                np.array(tag.place_m) + square(tag.side_m or side_m) @ turned(tag.turn_deg).T
                for tag in tags
            ]
        )
        pixels = self.lens.undistorted(np.concatenate([corners_by_tag[tag.id] for tag in tags]))
        flags = cv2.SOLVEPNP_IPPE if len(tags) == 1 else cv2.SOLVEPNP_SQPNP
        count, turns, shifts, errors = cv2.solvePnPGeneric(
            corners, pixels, self.lens.matrix, None, flags=flags
        )
        if not count or float(np.ravel(errors)[0]) > _MISFIT_PX:
            raise InputError(
                f"camera.fixed_tags: the places of tags {', '.join(str(t.id) for t in tags)} do "
                "not fit the picture; measure them again, or calibrate the lens"
            )
        if len(tags) == 1 and count > 1 and errors[1] < 2.0 * errors[0]:
            raise InputError(
                f"camera.fixed_tags: tag {tags[0].id} alone leaves two places of the camera; show "
                "a second fixed tag"
            )
        axes = np.asarray(cv2.Rodrigues(turns[0])[0], dtype=float)
        return replace(self, place_m=-axes.T @ shifts[0].ravel(), rotation=axes.T)


def _aimed_axes(camera: CameraConfig) -> tuple[Floats, Floats]:
    """Place and axes of a camera that looks at a place; the picture's top is up."""
    place = np.array(camera.place_m)
    aim = np.array(camera.aim_m)
    ahead = (aim - place) / np.linalg.norm(aim - place)
    # for a vertical camera, the picture's top is along y
    up = np.array([0.0, 1.0, 0.0]) if abs(ahead[2]) > 1.0 - 1e-9 else np.array([0.0, 0.0, 1.0])
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(ahead, right), ahead])
    return place, axes @ turned((0.0, 0.0, camera.roll_deg))
