"""A calibrated pair of cameras: its file, rectified pictures, and points from disparities.

Camera axes: x to the right, y down, z forward. A point ``p`` of the left camera is ``rotation @ p +
translation`` in the right one, as in OpenCV's ``stereoCalibrate``.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from snakewalk.config.archive import MOST_STORAGE_BYTES, read_arrays, read_bytes
from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.file_units import LENGTHS_M, unit_m
from snakewalk.config.reading import Fact, Facts, answered, by_file, by_user, decided, stated
from snakewalk.controller.images.calibration_storage import read_storage
from snakewalk.controller.images.colour_picture import read_colours
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice

_NAMES = {
    "k_left": ("K1", "M1", "cameraMatrix1", "camera_matrix_left", "K_left"),
    "distortion_left": ("D1", "distCoeffs1", "dist_coeffs_left", "D_left"),
    "k_right": ("K2", "M2", "cameraMatrix2", "camera_matrix_right", "K_right"),
    "distortion_right": ("D2", "distCoeffs2", "dist_coeffs_right", "D_right"),
    "rotation": ("R",),
    "translation": ("T",),
}
"""Names that people use for the results of ``stereoCalibrate``."""
_OPTIONAL = ("distortion_left", "distortion_right")
_MOST_BYTES = 1_000_000
_BASELINES_M = (0.005, 5.0)
"""Distances of two cameras that are possible (ours)."""


@dataclass(frozen=True, slots=True)
class StereoCalibration:
    """Result of a calibration."""

    k_left: Floats
    """(3, 3) camera matrix, pixels."""
    distortion_left: Floats
    """(4, 5, 8, 12 or 14) coefficients in OpenCV's order."""
    k_right: Floats
    distortion_right: Floats
    rotation: Floats
    """(3, 3) of the right camera."""
    translation_m: Floats
    """(3,) of the right camera; its x is below 0."""
    facts: Facts
    """Quantity, unit and order of the values."""
    notes: tuple[str, ...] = ()
    """Stored answers that were used."""


@dataclass(frozen=True, slots=True)
class RectifiedPair:
    """Two pictures with corresponding rows, and their camera."""

    left: Image
    right: Image
    seen: Bools
    """(H, W) where the left picture shows something."""
    focal_px: float
    centre_px: tuple[float, float]
    """Centre of the left picture."""
    offset_px: float
    """Column of the right picture's centre less that of the left's: a point at infinity has the
    disparity ``-offset_px``."""
    baseline_m: float
    turned: Floats
    """(3, 3) from the left camera's axes to the rectified ones."""

    def points_m(self, disparity: Floats) -> Floats:
        """(H, W, 3) points in the left camera's axes; NaN without a disparity."""
        rows, columns = disparity.shape
        u, v = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
        beyond = disparity + self.offset_px
        with np.errstate(invalid="ignore", divide="ignore"):
            per_px = np.where(beyond > 0.0, self.baseline_m / beyond, np.nan)
        x, y = (u - self.centre_px[0]) * per_px, (v - self.centre_px[1]) * per_px
        return np.stack([x, y, self.focal_px * per_px], axis=-1) @ self.turned


def read_calibration(file: Path, choice: CalibrationChoice | None = None) -> StereoCalibration:
    """Read a calibration by its ending, with the stored answers about it.

    Accepts files of OpenCV (.yml, .yaml, .xml, .json), .json with plain lists and .npz with the
    same names, and calib.txt of the Middlebury pairs, whose baseline is in millimetres.

    Raises:
        InputError: another format, a missing value, or not a pair side by side.
        OSError: it cannot be opened.

    """
    return answered(file, choice or CalibrationChoice(), lambda choice: _read(file, choice))


def _read(file: Path, choice: CalibrationChoice) -> StereoCalibration:
    if file.stat().st_size > _MOST_BYTES:
        raise InputError(f"{file}: is too large for a calibration")
    ending = file.suffix.lower()
    if ending == ".txt":
        unit = stated(file, "--unit", by_file("its format", "mm"), choice.unit)
        return _checked_calibration(file, _middlebury(file), unit)
    if ending in (".yml", ".yaml", ".xml", ".json"):
        storage = read_storage(file)
    elif ending == ".npz":
        try:
            storage, _ = read_arrays(file)
        except ValueError as error:
            raise InputError(f"{file}: is no .npz of numbers: {error}") from None
    else:
        raise InputError(f"{file}: a calibration ends in .yml, .yaml, .xml, .json, .npz or .txt")
    matrices: dict[str, Any] = {}
    for key, names in _NAMES.items():
        name = next((name for name in names if storage.get(name) is not None), None)
        if name is None and key not in _OPTIONAL:
            there = ", ".join(
                given_name for given_name, value in storage.items() if value is not None
            )
            raise InputError(f"{file}: holds no {' or '.join(names)}; it has {there or 'none'}")
        matrices[key] = np.zeros(5) if name is None else storage[name]
    return _checked_calibration(file, matrices, by_user("--unit", choice.unit))


def _middlebury(file: Path) -> dict[str, Any]:
    """``cam0=[f 0 cx; 0 f cy; 0 0 1]``, ``cam1``, ``baseline`` in mm, of rectified pictures."""
    text = read_bytes(file, MOST_STORAGE_BYTES).decode("utf-8", "replace")
    lines: Mapping[str, str] = dict(re.findall(r"^(\w+)\s*=\s*(.+)$", text, re.MULTILINE))
    try:
        k_left, k_right = (
            np.array([float(n) for n in re.split(r"[\s;,]+", lines[key].strip(" []\r"))])
            for key in ("cam0", "cam1")
        )
        baseline_mm = float(lines["baseline"])
        k_left, k_right = k_left.reshape(3, 3), k_right.reshape(3, 3)
    except (KeyError, ValueError) as error:
        raise InputError(
            f"{file}: is not a calib.txt with cam0, cam1, baseline: {error}; choose another file"
        ) from None
    return {
        "k_left": k_left,
        "k_right": k_right,
        "distortion_left": np.zeros(5),
        "distortion_right": np.zeros(5),
        "rotation": np.eye(3),
        "translation": np.array([-baseline_mm, 0.0, 0.0]),
    }


def _numbers(file: Path, matrices: Mapping[str, Any]) -> dict[str, Floats]:
    """Return the values as arrays of the right size."""
    values: dict[str, Floats] = {}
    for key, value in matrices.items():
        try:
            values[key] = np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError(f"{file}: {_NAMES[key][0]} holds no numbers") from None
    for key, size in (("k_left", 9), ("k_right", 9), ("rotation", 9), ("translation", 3)):
        if values[key].size != size:
            raise InputError(f"{file}: {_NAMES[key][0]} has {values[key].size} numbers, not {size}")
        values[key] = values[key].reshape((3, 3) if size == 9 else (3,))
    for key in _OPTIONAL:
        values[key] = values[key].ravel()
        if values[key].size not in (4, 5, 8, 12, 14):
            raise InputError(f"{file}: {_NAMES[key][0]} has {values[key].size} coefficients")
    faults = [
        f"{file}: {_NAMES[k][0]} is not finite"
        for k, v in values.items()
        if not np.isfinite(v).all()
    ]
    if faults:
        raise InputError(faults)
    return values


def _checked_calibration(
    file: Path, matrices: Mapping[str, Any], unit: Fact | None
) -> StereoCalibration:
    values = _numbers(file, matrices)
    rotation = values["rotation"]
    translation = values["translation"]
    for key in ("k_left", "k_right"):
        if min(values[key][0, 0], values[key][1, 1]) <= 0.0:
            raise InputError(f"{file}: {_NAMES[key][0]} has no focal length above 0")
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3):
        raise InputError(f"{file}: R is no rotation")
    if -translation[0] < 2.0 * float(np.hypot(*translation[1:])) or translation[0] >= 0.0:
        shown = ", ".join(f"{value:.3g}" for value in translation)
        raise InputError(
            f"{file}: T is ({shown}): the second camera must stand to the right of the first "
            "(x below 0, in OpenCV's order); if it stands to the left, exchange the cameras"
        )
    unit = _unit(file, float(np.linalg.norm(translation)), unit)
    facts: Facts = {
        "quantity": Fact("calibration of two cameras", "file", "its names of matrices"),
        "unit": unit,
        "order": Fact("left, then right", "file", "the sign of T"),
    }
    return StereoCalibration(
        values["k_left"],
        values["distortion_left"],
        values["k_right"],
        values["distortion_right"],
        rotation,
        unit_m(unit.value) * translation,
        facts,
    )


def _unit(file: Path, baseline: float, unit: Fact | None) -> Fact:
    """Unit of a baseline: stated, or the only one in which it is that of a pair of cameras.

    Raises:
        InputError: several are possible, or the stated one is not.

    """
    apart_m = {name: baseline * LENGTHS_M[name] for name in ("m", "cm", "mm")}
    low_m, high_m = _BASELINES_M
    possible = {
        name: f"cameras {apart:.4g} m apart"
        for name, apart in apart_m.items()
        if low_m <= apart <= high_m
    }
    if not possible or (unit and unit.value in apart_m.keys() - possible):
        raise InputError(
            f"{file}: the length of T is {baseline:.4g}; possible units: "
            f"{', '.join(possible) or 'none; calibrate again with the size of a square'}"
        )
    if unit is None and list(possible) == ["m"]:
        unit = Fact("m", "inferred", "no other unit is possible; --unit states another")
    question = f"states no unit of T, whose length is {baseline:.4g}"
    return decided(file, question, "--unit", possible, unit)


def read_pair(calibration: StereoCalibration, left: Path, right: Path) -> RectifiedPair:
    """Read and rectify two colour pictures; return colours, red first.

    Raises:
        InputError: not two pictures of the calibration's size.

    """
    pictures = (np.ascontiguousarray(read_colours(file)[..., ::-1]) for file in (left, right))
    return rectify(calibration, *pictures)


def rectify(calibration: StereoCalibration, left: Image, right: Image) -> RectifiedPair:
    """Warp two pictures so that a point has the same row in both; ideal pairs are unchanged.

    Raises:
        InputError: the sizes differ, or do not fit the calibration.

    """
    c, (rows, columns) = calibration, left.shape[:2]
    if left.shape != right.shape:
        raise InputError(f"stereo: the pictures are {left.shape} and {right.shape}")
    for k in (c.k_left, c.k_right):
        if not (0.0 < k[0, 2] < columns and 0.0 < k[1, 2] < rows):
            raise InputError(
                f"stereo: pictures of {columns} by {rows} px do not fit the calibration, whose "
                f"centre is ({k[0, 2]:.0f}, {k[1, 2]:.0f}): it is of pictures of another size"
            )
    ideal = not (c.distortion_left.any() or c.distortion_right.any() or c.translation_m[1:].any())
    are_equal = np.allclose(np.delete(c.k_left, 2), np.delete(c.k_right, 2)) and np.isclose(
        c.k_left[0, 0], c.k_left[1, 1]
    )
    if ideal and are_equal and np.allclose(c.rotation, np.eye(3)):
        offset_px = float(c.k_right[0, 2] - c.k_left[0, 2])
        centre = float(c.k_left[0, 2]), float(c.k_left[1, 2])
        is_visible = np.ones((rows, columns), bool)
        baseline_m = -float(c.translation_m[0])
        focal_px = float(c.k_left[0, 0])
        return RectifiedPair(
            left, right, is_visible, focal_px, centre, offset_px, baseline_m, np.eye(3)
        )
    size = (columns, rows)
    turn_left, turn_right, p_left, p_right, *_ = cv2.stereoRectify(
        c.k_left,
        c.distortion_left,
        c.k_right,
        c.distortion_right,
        size,
        c.rotation,
        c.translation_m[:, None],
        flags=cv2.CALIB_ZERO_DISPARITY,
        alpha=0,
    )
    warped = []
    for picture, k, distortion, turn, p in (
        (left, c.k_left, c.distortion_left, turn_left, p_left),
        (right, c.k_right, c.distortion_right, turn_right, p_right),
        (np.full((rows, columns), 255, np.uint8), c.k_left, c.distortion_left, turn_left, p_left),
    ):
        maps = cv2.initUndistortRectifyMap(k, distortion, turn, p, size, cv2.CV_32FC1)
        warped.append(np.asarray(cv2.remap(picture, *maps, cv2.INTER_LINEAR), dtype=np.uint8))
    return RectifiedPair(
        warped[0],
        warped[1],
        warped[2] == 255,
        float(p_left[0, 0]),
        (float(p_left[0, 2]), float(p_left[1, 2])),
        float(p_right[0, 2] - p_left[0, 2]),
        -float(p_right[0, 3] / p_right[0, 0]),
        np.asarray(turn_left, dtype=float),
    )
