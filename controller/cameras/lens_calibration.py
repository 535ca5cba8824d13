"""The lens from pictures of a board: OpenCV's calibration, and its accuracy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.calibration_board import BoardView
from snakewalk.controller.cameras.lens import Lens

FEWEST_VIEWS = 5
_OUTLIER = 3.0  # times the median view's residual: a blurred or misread picture (ours)
_CELLS = 6  # in each direction, to count corners
_FLAGS = cv2.CALIB_FIX_K3  # a board seldom reaches the corners, which determine k3


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """A lens, and the quality of its pictures."""

    lens: Lens
    rms_px: float
    """Root mean square distance of corners from where the lens puts them."""
    view_rms_px: Floats
    """(V,) residual of each view; NaN for omitted views."""
    focal_error_px: float
    """Standard error of the focal length."""
    centre_error_px: float
    """Standard error of the principal point."""
    coverage: float
    """Share of the picture's 6 x 6 parts in which a corner was seen."""
    tilt_deg: float
    """Largest angle between the board and the picture's plane."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Proposals for improvement; empty if all is well."""
        focal = float(self.lens.matrix[0, 0])
        remark_list = []
        if self.rms_px > 1.0:
            remark_list.append(
                f"the residual of {self.rms_px:.2f} px is large; check that the board is flat, "
                "the size of its squares, and the focus"
            )
        if self.coverage < 0.6:
            remark_list.append(
                f"corners lie in {100.0 * self.coverage:.0f} % of the picture: hold the board into "
                "its corners too, where distortion is largest"
            )
        if self.tilt_deg < 15.0:
            remark_list.append(
                f"the board was never tilted by more than {self.tilt_deg:.0f} degrees, which "
                "does not separate distance from focal length; tilt it more"
            )
        if self.focal_error_px > 0.01 * focal:
            remark_list.append(
                f"the focal length is known to {self.focal_error_px:.1f} of {focal:.0f} px only"
            )
        return tuple(remark_list)


def calibrate_lens(views: Sequence[BoardView | None], size_px: tuple[int, int]) -> LensCalibration:
    """Find the lens; outlying views are dropped.

    ``views`` are the boards found in each picture, or None.

    Raises:
        InputError: too few views, or none that fix a lens.

    """
    used = {k: view for k, view in enumerate(views) if view is not None}
    if len(used) < FEWEST_VIEWS:
        raise InputError(
            f"the board was found in {len(used)} of {len(views)} pictures, {FEWEST_VIEWS} are "
            "needed and 15 are better; check pattern, squares, focus and light"
        )
    while True:
        calibrated = _calibrated_lens(used, size_px, len(views))
        usual = float(np.nanmedian(calibrated.view_rms_px))
        good_views = {
            k: view
            for k, view in used.items()
            if calibrated.view_rms_px[k] <= _OUTLIER * usual + 0.1
        }
        if len(good_views) in (len(used), *range(FEWEST_VIEWS)):
            return calibrated
        used = good_views


def _calibrated_lens(
    views: Mapping[int, BoardView], size_px: tuple[int, int], count: int
) -> LensCalibration:
    """Calibrate with all of ``views``, by their index among ``count``."""
    board = [np.column_stack([v.corners_m, np.zeros(len(v.corners_m))]) for v in views.values()]
    try:
        rms, matrix, distortion, turns, _, errors, _, residuals = cv2.calibrateCameraExtended(
            [points.astype(np.float32) for points in board],
            [view.corners_px.astype(np.float32) for view in views.values()],
            size_px,
            np.eye(3),
            np.zeros(5),
            flags=_FLAGS,
        )
    except cv2.error as error:
        raise InputError(f"the pictures fix no lens: {error.err}") from None
    matrix = np.asarray(matrix, dtype=float)
    spread = np.asarray(errors, dtype=float).ravel()
    if not np.isfinite(matrix).all() or not np.isfinite(rms) or min(matrix[[0, 1], [0, 1]]) <= 0.0:
        raise InputError("the pictures fix no lens: hold the board at more angles and distances")
    view_rms = np.full(count, np.nan)
    view_rms[list(views)] = np.asarray(residuals, dtype=float).ravel()
    places = np.concatenate([view.corners_px for view in views.values()])
    cells = np.clip(_CELLS * places // size_px, 0, _CELLS - 1)
    facing = [float(cv2.Rodrigues(turn)[0][2, 2]) for turn in turns]
    return LensCalibration(
        lens=Lens(
            size_px, np.asarray(matrix, dtype=float), np.asarray(distortion, dtype=float).ravel()
        ),
        rms_px=float(rms),
        view_rms_px=view_rms,
        focal_error_px=float(spread[:2].max()),
        centre_error_px=float(spread[2:4].max()),
        coverage=len(np.unique(cells, axis=0)) / _CELLS**2,
        tilt_deg=float(np.degrees(np.arccos(np.clip(min(facing), -1.0, 1.0)))),
    )
