"""Metres in a pixel: from the animal's own length, a printed marker, or two places."""

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError

_FAMILIES = (
    cv2.aruco.DICT_4X4_50,
    cv2.aruco.DICT_5X5_50,
    cv2.aruco.DICT_6X6_50,
    cv2.aruco.DICT_ARUCO_ORIGINAL,
    cv2.aruco.DICT_APRILTAG_36h11,
)


def scale_of_length(length_m: float, length_px: Floats) -> float:
    """Metres a pixel, from the animal's ``length_m`` and its length in every frame."""
    return length_m / float(np.nanmedian(length_px))


def scale_of_marker(marker: str, image: Image) -> float:
    """Metres a pixel from a marker of known size.

    Args:
        marker: ``SIDE``, m, of a square ArUco or AprilTag marker in the image; or
            ``X0,Y0,X1,Y1,METRES``: two places in the image and their distance.
        image: a frame or the background, (H, W[, 3]).

    Raises:
        InputError: neither, or no marker in the image.

    """
    try:
        numbers = [float(part) for part in marker.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in {1, 5} or not np.isfinite(numbers).all() or numbers[-1] <= 0.0:
        raise InputError(
            f"--marker {marker}: expected the SIDE in metres of a printed marker in view, or "
            "X0,Y0,X1,Y1,METRES for two places in the image"
        )
    if len(numbers) == 5:
        distance_px = float(np.hypot(numbers[2] - numbers[0], numbers[3] - numbers[1]))
        if distance_px < 1.0:
            raise InputError(f"--marker {marker}: the two places must be apart")
        return numbers[4] / distance_px
    sides = _sides(image)
    if not sides:
        raise InputError(f"--marker {marker}: no ArUco or AprilTag marker in the image")
    return numbers[0] / float(np.median(sides))


def _sides(image: Image) -> list[float]:
    """Side lengths, px, of all markers of the first family found."""
    for family in _FAMILIES:
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(family), settings)
        corners, _, _ = detector.detectMarkers(image)
        if len(corners):
            square = np.concatenate(corners)
            return [float(v) for v in np.hypot(*(square - np.roll(square, 1, 1)).T).ravel()]
    return []
