"""The lens of a camera: matrix and distortion as in OpenCV's calibration, and its file.

The file is an OpenCV FileStorage, or JSON with plain lists, with the names of OpenCV's calibration
sample: ``image_width``, ``image_height``, ``camera_matrix``, ``distortion_coefficients``.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.archive import why_no_file
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.console.result_files import check_ending
from snakewalk.controller.images.calibration_storage import read_storage

_MATRICES = "camera_matrix", "distortion_coefficients"
ENDINGS = (".yml", ".yaml", ".xml", ".json")
_COEFFICIENTS = (4, 5, 8, 12, 14)
_STEPS = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-9)


def projected(homography: NDArray[Any], points: Floats) -> Floats:
    """(..., 2) images of points (..., 2) under a homography (3, 3)."""
    x, y = points[..., 0], points[..., 1]
    moved = [row[0] * x + row[1] * y + row[2] for row in homography]
    return np.stack([moved[0] / moved[2], moved[1] / moved[2]], axis=-1)


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole with distortion."""

    size_px: tuple[int, int]
    """Width, height of its pictures."""
    matrix: Floats
    """(3, 3) camera matrix, pixels."""
    distortion: Floats
    """(4, 5, 8, 12 or 14) coefficients in OpenCV's order."""

    def undistorted(self, points_px: Floats) -> Floats:
        """(..., 2) pixels (..., 2) without distortion."""
        flat = np.ascontiguousarray(points_px, dtype=float).reshape(-1, 1, 2)
        undistorted_px = cv2.undistortImagePoints(flat, self.matrix, self.distortion, arg1=_STEPS)
        return np.asarray(undistorted_px, dtype=float).reshape(points_px.shape)

    def distorted(self, points_px: Floats) -> Floats:
        """(..., 2) pixels with distortion of pixels (..., 2) without it."""
        flat = np.asarray(points_px, dtype=float).reshape(-1, 2)
        rays = np.linalg.solve(self.matrix, np.column_stack([flat, np.ones(len(flat))]).T).T
        none = np.zeros(3)
        distorted_px, _ = cv2.projectPoints(
            np.ascontiguousarray(rays), none, none, self.matrix, self.distortion
        )
        return np.asarray(distorted_px, dtype=float).reshape(points_px.shape)

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read a file of ``snakewalk pose lens``, or of OpenCV's calibration.

        Raises:
            InputError: it does not exist, is of another kind, or does not describe a lens.

        """
        check_ending(file, "the file of a lens", *ENDINGS)
        if not file.is_file():
            raise InputError(why_no_file(file))
        size, matrices = _stored_matrices(file)
        faults = [
            f"{file}: holds no {name}"
            for name, value in zip(_MATRICES, matrices, strict=True)
            if value is None
        ]
        if not all(1.0 <= side <= 100_000.0 for side in size):
            faults.append(f"{file}: image_width and image_height are needed, whole and above 0")
        if faults:
            raise InputError(faults)
        matrix, distortion = (_numbers(value) for value in matrices)
        if matrix.size == 9:
            matrix = matrix.reshape(3, 3)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            faults.append(f"{file}: camera_matrix is not 3 x 3 numbers")
        elif min(matrix[0, 0], matrix[1, 1]) <= 0.0 or abs(np.linalg.det(matrix)) < 1e-9:
            faults.append(f"{file}: camera_matrix has no focal length above 0")
        if distortion.size not in _COEFFICIENTS or not np.isfinite(distortion).all():
            faults.append(f"{file}: distortion_coefficients are not 4, 5, 8, 12 or 14 numbers")
        if faults:
            raise InputError(faults)
        return cls((int(size[0]), int(size[1])), matrix, distortion.ravel())

    def write(self, file: Path, rms_px: float, views: int) -> None:
        """Write the file in the format of its ending, with the quality of the fit."""
        store = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
        store.write("image_width", self.size_px[0])
        store.write("image_height", self.size_px[1])
        store.write("camera_matrix", self.matrix)
        store.write("distortion_coefficients", self.distortion.reshape(1, -1))
        store.write("avg_reprojection_error", rms_px)
        store.write("nframes", views)
        store.release()


def _numbers(value: Any) -> Floats:
    """Array of a stored value; empty if it is not numbers."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return np.zeros(0)


def _stored_matrices(file: Path) -> tuple[list[float], list[Any]]:
    """Width and height, and the two matrices; 0 and None for missing names.

    Raises:
        InputError: the file cannot be read.

    """
    stored = read_storage(file)
    size = [_numbers(stored.get(side)) for side in ("image_width", "image_height")]
    return [float(side.item()) if side.size == 1 else 0.0 for side in size], [
        stored.get(name) for name in _MATRICES
    ]
