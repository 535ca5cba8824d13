"""Distortion of an uncalibrated lens, from the printed markers on the floor.

Without distortion, pixels and floor are one homography: places and shapes of the markers agree
within their accuracy. The fit adds one radial coefficient about the picture's middle, and reports
it only if it is significant.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from snakewalk.config.arrays import Floats, Singles
from snakewalk.controller.cameras.lens import projected
from snakewalk.controller.cameras.markers.floor_markers import FEWEST, Markers, middle_of

_CORNER_PX = 0.3  # standard deviation of a corner (ours)
_PLACE_M = 0.004  # of a marker's measured place, per coordinate (ours)
_SIDE = 0.02  # of the side of all prints, as a share (ours)
_SURE_SIGMAS = 3.0  # standard deviations of the coefficient from 0 (ours)
_STARTS = 0.0, 0.1  # of the coefficient: strong distortion has a second minimum (ours)
_GRID = 9  # points across the picture for the error
_SQUARE = np.array([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]])  # as printed
_WIDE_LENS = 0.3  # coefficient; that of a lens of 77 degrees with k1 = -0.3 is 0.27 (ours)
_SPAN_M = 1.0  # of floor over which a distortion rotates a body (ours)
NOTICEABLE_M = 0.005
"""A smaller error of a place on the floor is not reported."""


@dataclass(frozen=True, slots=True)
class Distortion:
    """Radial distortion in the markers."""

    coefficient: float
    """Share by which radii grow when the distortion is undone, at half a picture's width."""
    sigma: float
    """Standard deviation of the coefficient."""
    error_m: float
    """Largest error on the floor between the markers, if the distortion is ignored."""
    is_assumed: bool = False
    """Whether nothing shows the distortion: four corners fit any lens exactly."""

    @property
    def is_certain(self) -> bool:
        """Whether the lens distorts noticeably and significantly."""
        return abs(self.coefficient) > _SURE_SIGMAS * self.sigma and self.error_m > NOTICEABLE_M

    @property
    def covariance(self) -> Floats:
        """(3, 3) of x, y (m) and heading (rad) of a body, if the distortion is ignored."""
        return np.diag([(0.5 * self.error_m) ** 2] * 2 + [(0.5 * self.error_m / _SPAN_M) ** 2])

    def __str__(self) -> str:
        """Warning with its remedy."""
        cause = (
            "four corners do not show whether the lens distorts: if it does,"
            if self.is_assumed
            else "the floor's markers show that the lens distorts:"
        )
        return (
            f"{cause} places are up to {1e3 * self.error_m:.0f} mm off; calibrate it "
            "(snakewalk pose board, snakewalk pose lens) and set [camera] lens"
        )


def marker_distortion(
    markers: Markers,
    places_m: Mapping[int, Sequence[float]],
    size_px: tuple[int, int],
    side_m: float,
) -> Distortion | None:
    """Estimate the distortion of a lens from markers in a picture.

    Args:
        markers: corners of the markers.
        places_m: (2,) of each marker's centre on the floor.
        size_px: width and height of the picture.
        side_m: of a printed marker.

    Returns:
        None for fewer than four markers, or markers on a line.

    """
    names = sorted(set(markers) & set(places_m))
    if len(names) < FEWEST:
        return None
    middle = 0.5 * (np.array(size_px) - 1.0)
    unit = 0.5 * size_px[0]
    px = (np.array([markers[name] for name in names]) - middle) / unit
    floor = np.array([places_m[name] for name in names], dtype=float)
    start, _ = cv2.findHomography(np.array([middle_of(corners_px) for corners_px in px]), floor)
    if start is None or not np.isfinite(start).all() or abs(start[2, 2]) < 1e-9:
        return None
    start = np.asarray(start, dtype=float) / start[2, 2]
    corners = projected(start, px)
    top = corners[:, 1] - corners[:, 0]
    turns = np.arctan2(top[:, 1], top[:, 0])
    metre_px = unit * float(np.mean(np.hypot(*(px[:, 1] - px[:, 0]).T) / np.hypot(*top.T)))
    count = len(names)

    def off(values: Floats) -> Floats:
        homography = np.append(values[:8], 1.0).reshape(3, 3)
        turn = values[10 : 10 + count]
        away = values[10 + count :].reshape(count, 2)
        c, s = np.cos(turn), np.sin(turn)
        spin = np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=1)
        squares = side_m * (1.0 + _SIDE * values[9]) * (_SQUARE @ spin)
        expected_m = (floor + _PLACE_M * away)[:, None] + squares
        projected_m = projected(homography, _undistorted(px, float(values[8])))
        return np.concatenate(
            [
                ((projected_m - expected_m) * metre_px / _CORNER_PX).ravel(),
                away.ravel(),
                values[9:10],
            ]
        )

    first = np.concatenate([start.ravel()[:8], [0.0, 0.0], turns, np.zeros(2 * count)])
    fits = []
    for coefficient in _STARTS:
        first[8] = coefficient
        fits.append(least_squares(off, first, method="lm", x_scale="jac", max_nfev=4000))
    fit = min(fits, key=lambda lens_fit: float(lens_fit.cost))
    slopes: Floats = np.array(fit.jac, dtype=float)
    inverse = np.linalg.pinv(slopes.T @ slopes)
    spare = max(len(fit.fun) - len(first), 1)
    sigma = float(np.sqrt(inverse[8, 8] * max(1.0, 2.0 * fit.cost / spare)))
    homography = np.append(fit.x[:8], 1.0).reshape(3, 3)
    coefficient = float(fit.x[8])
    return Distortion(coefficient, sigma, _largest_error(start, homography, px, coefficient))


def assumed_distortion(px: Singles, floor_m: Singles, size_px: tuple[int, int]) -> Distortion:
    """Distortion that an uncalibrated wide lens may have, where four corners fix the floor.

    Args:
        px: (4, 2) corners in the picture.
        floor_m: (4, 2) the same on the floor.
        size_px: width and height of the picture.

    """
    points = (px - 0.5 * (np.array(size_px) - 1.0)) / (0.5 * size_px[0])
    ignored, known = (
        np.asarray(cv2.getPerspectiveTransform(seen.astype(np.float32), floor_m), dtype=float)
        for seen in (points, _undistorted(points, _WIDE_LENS))
    )
    error_m = _largest_error(ignored, known, points, _WIDE_LENS)
    return Distortion(_WIDE_LENS, 0.5 * _WIDE_LENS, error_m, is_assumed=True)


def _largest_error(ignored: Floats, known: Floats, px: Floats, coefficient: float) -> float:
    """Largest error between the places (..., 2), if the distortion is ignored."""
    flat = px.reshape(-1, 2)
    sides = (
        np.linspace(low, high, _GRID)
        for low, high in zip(flat.min(axis=0), flat.max(axis=0), strict=True)
    )
    grid = np.stack(np.meshgrid(*sides), axis=-1)
    off = projected(ignored, grid) - projected(known, _undistorted(grid, coefficient))
    return float(np.hypot(off[..., 0], off[..., 1]).max())


def _undistorted(points: Floats, coefficient: float) -> Floats:
    """(..., 2) points about the picture's middle without radial distortion."""
    radius2 = np.square(points).sum(axis=-1, keepdims=True)
    return np.asarray(points * (1.0 + coefficient * radius2))
