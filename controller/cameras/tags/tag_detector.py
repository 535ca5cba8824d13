"""Printed tags in a picture: the corners of known tags."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.floor_light import grey_of

Corners = Mapping[int, Floats]
"""Corners (4, 2) of each tag by its number, pixels: upper left of the print first, clockwise."""
_LEAST_SIDE_PX = 8.0
"""Tags with a shorter side are left out: their numbers are guesses (ours)."""


@dataclass(frozen=True, slots=True)
class TagPicture:
    """The tags of one picture."""

    time_s: float
    """Time at which the picture was taken."""
    corners_px: Corners


def tag_dictionary(name: str) -> Any:
    """Return OpenCV's dictionary ``DICT_name``.

    Raises:
        InputError: it does not exist.

    """
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if not isinstance(number, int):
        raise InputError(
            f"tags: dictionary: {name}: OpenCV has no DICT_{name}; use for example 4X4_50 or "
            "APRILTAG_36h11"
        )
    return cv2.aruco.getPredefinedDictionary(number)


class TagDetector:
    """Finds tags in pictures."""

    def __init__(self, dictionary: str, ids: Collection[int]) -> None:
        """Search for the tags with the numbers ``ids``.

        Raises:
            InputError: the dictionary, or a tag in it, does not exist.

        """
        tags = tag_dictionary(dictionary)
        beyond = [number for number in ids if number >= len(tags.bytesList)]
        if beyond:
            raise InputError(
                f"tags: tag {beyond[0]}: {dictionary} has the numbers 0 to "
                f"{len(tags.bytesList) - 1}"
            )
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._known = frozenset(ids)
        self._detector = cv2.aruco.ArucoDetector(tags, parameters)

    def find(self, picture: Image) -> dict[int, Floats]:
        """Return the corners of each tag that a picture (H, W[, 3]) shows once."""
        grey = grey_of(picture)
        corners, numbers, _ = self._detector.detectMarkers(grey)
        corners_by_id: dict[int, Floats] = {}
        twice = set()
        for square, number in zip(corners, () if numbers is None else numbers.ravel(), strict=True):
            corners_px = np.asarray(square, dtype=float).reshape(4, 2)
            if (
                number not in self._known
                or np.hypot(*(corners_px - np.roll(corners_px, 1, 0)).T).min() < _LEAST_SIDE_PX
            ):
                continue
            if number in corners_by_id:
                twice.add(int(number))
            corners_by_id[int(number)] = corners_px
        return {
            number: corners_px
            for number, corners_px in corners_by_id.items()
            if number not in twice
        }
