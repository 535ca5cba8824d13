"""The printed board of a calibration: a chessboard, or a ChArUco board that may be cut off."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.floor_light import grey_of

DICTIONARY = "DICT_5X5_250"
"""Dictionary of the markers on a ChArUco board; those on the floor are of another."""
_MARKER = 0.75  # of a square's side
_MOST_SQUARES = 20
_INCH_M = 0.0254


BoardPattern = Literal["charuco", "chessboard"]
"""Pattern to print."""


@dataclass(frozen=True)
class BoardView:
    """The corners found in one picture."""

    corners_px: Floats
    """(N, 2) corners of the board in the picture, x, y."""
    corners_m: Floats
    """(N, 2) corners of the board on the board, m."""


@dataclass(frozen=True)
class CalibrationBoard:
    """A board of squares.

    Raises:
        InputError: too few or too many squares, or a side out of range.

    """

    pattern: BoardPattern
    squares: tuple[int, int] = (7, 5)
    """Squares across and down; a chessboard has one inner corner fewer in each direction."""
    square_m: float = 0.036

    def __post_init__(self) -> None:
        across, down = self.squares
        if not (min(across, down) >= 4 and max(across, down) <= _MOST_SQUARES) or across == down:
            raise InputError(
                f"a board of {across} x {down} squares: must be 4 to {_MOST_SQUARES} each way, and "
                "not as many down as across"
            )
        if not 0.001 <= self.square_m <= 1.0:
            raise InputError(f"a board's square of {self.square_m:g} m: must be 0.001 to 1 m")

    @cached_property
    def _charuco(self) -> Any:
        words = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
        return cv2.aruco.CharucoBoard(self.squares, self.square_m, _MARKER * self.square_m, words)

    @cached_property
    def _detector(self) -> Any:
        return cv2.aruco.CharucoDetector(self._charuco)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of all squares."""
        return self.squares[0] * self.square_m, self.squares[1] * self.square_m

    def picture(self, dots_per_inch: float) -> Image:
        """(H, W) the printed board without a margin."""
        side = max(8, round(self.square_m / _INCH_M * dots_per_inch))
        across, down = self.squares
        if self.pattern == "charuco":
            drawn = self._charuco.generateImage((across * side, down * side), None, 0, 1)
            return np.asarray(drawn, dtype=np.uint8)
        x, y = np.meshgrid(np.arange(across * side) // side, np.arange(down * side) // side)
        return np.where((x + y) % 2, 255, 0).astype(np.uint8)

    def find(self, picture: Image) -> BoardView | None:
        """Find the corners in a picture (H, W[, 3]); None if there are too few."""
        grey = grey_of(picture)
        places = np.asarray(self._charuco.getChessboardCorners(), dtype=float)[:, :2]
        if self.pattern == "charuco":
            corners, ids, _, _ = self._detector.detectBoard(grey)
            if ids is None:
                return None
            tag_ids: Ints = np.asarray(ids, dtype=int).ravel()
            places = places[tag_ids]
        else:
            inner = self.squares[0] - 1, self.squares[1] - 1
            is_complete, corners = cv2.findChessboardCornersSB(
                grey, inner, flags=cv2.CALIB_CB_ACCURACY
            )
            if not is_complete:
                return None
        if len(places) < 6 or _on_a_line(places):
            return None
        return BoardView(np.asarray(corners, dtype=float).reshape(-1, 2), places)


def _on_a_line(places: Floats) -> bool:
    return bool(np.linalg.svd(places - places.mean(axis=0), compute_uv=False)[1] < 1e-6)
