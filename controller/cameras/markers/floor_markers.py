"""Printed markers on the floor: detection, fit of the floor, and bumps of the camera.

A marker is a square of ArUco's smallest dictionary: at a side of 16 px a cell has 2.7 px.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.floor_light import grey_of
from snakewalk.controller.cameras.lens import Lens, projected

DICTIONARY = "DICT_4X4_50"
COUNT = 50
"""Numbers of markers are below."""
FEWEST = 4
"""Markers that fix a floor."""
_CELLS = 6  # across a marker, its black border included
_LARGER = 2  # enlargement of the picture for the search: cells of 2 px (ours)
_INCH_M = 0.0254
_DRAWN = 6, 24  # px per cell of the print fitted to a picture, least and most
_STEPS = cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-4
_SMOOTH = 3  # px of the smoothing before a print is fitted
_FURTHEST_CORNER = 0.5  # of a cell: largest correction of a corner (ours)
_AGREE_PX = 1.5  # largest residual of a marker that moved with the picture (ours)
_FEWEST_MOVED = 3  # markers seen before and now, for the picture's move
_TURNED_CAMERA_PX = 0.5  # largest residual of a purely rotated camera (ours)
_LEAST_SPREAD = 0.05  # of markers' places: less is a line
Markers = Mapping[int, Floats]
"""Corners (4, 2) of each marker by its number, pixels, the upper left of the print first."""


@dataclass(frozen=True, slots=True)
class FloorFit:
    """The floor from its markers."""

    floor_from_px: Floats
    """(3, 3) homography of pixels without distortion to metres."""
    residual_m: Mapping[int, float]
    """Distance of each marker's middle from its measured place. Four markers without a lens fit
    always."""
    side_m: Mapping[int, float]
    """Side of each marker according to the homography."""
    lens_m: Floats | None
    """(3,) where the camera's lens is, where its matrix is known."""

    @property
    def rms_m(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(np.square(list(self.residual_m.values())))))


@dataclass(frozen=True, slots=True)
class Bump:
    """Move of a camera's picture since its set-up."""

    shift_px: tuple[float, float]
    """Shift of the picture's middle in x and y."""
    turn_rad: float = 0.0
    """Turn of the picture, clockwise for the viewer."""
    left_out: tuple[int, ...] = ()
    """Markers that did not move with the others: they were moved on the floor."""
    undone: bool = True
    """Whether the pose accounts for the bump; else no more poses are returned."""

    @property
    def away_px(self) -> float:
        """Length of the shift."""
        return float(np.hypot(*self.shift_px))

    def __str__(self) -> str:
        """Text of the event."""
        if not self.undone:
            return (
                f"floor markers: lie about {self.away_px:.1f} px from their places, each in "
                "another direction, so camera or markers moved; set the camera up again"
            )
        said = []
        if self.away_px >= 0.05 or abs(self.turn_rad) > 1e-3:
            turned = np.degrees(abs(self.turn_rad))
            said.append(
                f"the camera was bumped: its picture has moved by {self.away_px:.1f} px"
                + (f" and turned by {turned:.1f} degrees" if turned >= 0.05 else "")
                + ", which is undone"
            )
        if self.left_out:
            is_single = len(self.left_out) == 1
            names = " and ".join(str(number) for number in self.left_out)
            said.append(
                f"marker {names} was moved on the floor and is left out"
                if is_single
                else f"markers {names} were moved on the floor and are left out"
            )
        return "; ".join(said) or "the camera is again where it was set up"


@dataclass(frozen=True, slots=True)
class PictureMove:
    """Map from earlier to present pixels of the same place."""

    present_from_earlier: Floats
    """(3, 3) homography of pixels without distortion."""
    bump: Bump


def marker_picture(number: int, side_px: int) -> Image:
    """(side, side) a printed marker without its white margin."""
    side = max(1, side_px // _CELLS) * _CELLS
    drawn = cv2.aruco.generateImageMarker(_dictionary(), number, side)
    return np.asarray(drawn, dtype=np.uint8)


def marker_sheet(number: int, side_m: float, dots_per_inch: float) -> Image:
    """(H, W) a page: the marker, half a cell of white, and its number and side."""
    drawn = marker_picture(number, round(side_m / _INCH_M * dots_per_inch))
    margin = len(drawn) // (2 * _CELLS)
    foot = len(drawn) // 6
    page = np.pad(drawn, ((margin, margin + foot), (margin, margin)), constant_values=255)
    text = f"marker {number}   {1e3 * side_m:g} mm"
    thick = max(1, len(drawn) // 400)
    size = 0.6 * len(drawn) / cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, thick)[0][0]
    place_px = margin, len(page) - margin // 2
    cv2.putText(page, text, place_px, cv2.FONT_HERSHEY_SIMPLEX, size, 0, thick, cv2.LINE_AA)
    return page


def find_markers(picture: Image) -> dict[int, Floats]:
    """Corners of the markers in a picture (H, W[, 3]), except those seen twice."""
    grey = grey_of(picture)
    large = cv2.resize(grey, None, fx=_LARGER, fy=_LARGER, interpolation=cv2.INTER_CUBIC)
    corners, numbers, _ = cv2.aruco.ArucoDetector(_dictionary()).detectMarkers(large)
    names = [] if numbers is None else np.asarray(numbers, dtype=int).ravel().tolist()
    places = [
        (np.asarray(corner, dtype=float).reshape(4, 2) + 0.5) / _LARGER - 0.5 for corner in corners
    ]
    return {
        name: _aligned_corners(grey, name, place)
        for name, place in zip(names, places, strict=True)
        if names.count(name) == 1
    }


def _aligned_corners(grey: NDArray[Any], number: int, corners: Floats) -> Floats:
    """Corners by fitting the whole print: gain and saturation do not move them."""
    cells_px = float(np.hypot(*(corners[1] - corners[0]))) / _CELLS
    cell = int(np.clip(cells_px, *_DRAWN))
    drawn = marker_picture(number, _CELLS * cell)
    white = cell // 2  # a sheet may end beyond
    sheet = np.pad(drawn, white, constant_values=255).astype(np.float32)
    low, high = white - 0.5, white - 0.5 + len(drawn)
    ends = np.array([[low, low], [high, low], [high, high], [low, high]])
    there = cv2.getPerspectiveTransform(ends.astype(np.float32), corners.astype(np.float32))
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    warped = cv2.warpPerspective(grey, there, sheet.shape[::-1], flags=flags).astype(np.float32)
    sheet = np.asarray(cv2.GaussianBlur(sheet, (0, 0), max(0.3, 0.5 * cell / cells_px)))
    start = np.eye(2, 3, dtype=np.float32)
    mask = np.full(warped.shape, 255, np.uint8)
    try:
        _, move = cv2.findTransformECC(
            sheet, warped, start, cv2.MOTION_AFFINE, _STEPS, mask, _SMOOTH
        )
    except cv2.error:  # no convergence: half covered, or blurred
        return corners
    turned = ends @ np.asarray(move[:, :2], dtype=float).T + move[:, 2]
    better = projected(np.asarray(there, dtype=float), turned)
    return better if np.abs(better - corners).max() < _FURTHEST_CORNER * cells_px else corners


def fit_floor(
    markers: Markers, places_m: Mapping[int, Sequence[float]], lens: Lens | None
) -> FloorFit:
    """Fit the floor to the centres of its markers.

    Args:
        markers: in a picture.
        places_m: (2,) of each marker's centre on the floor.
        lens: None: pixels and floor are one homography; otherwise the camera's place is fitted too.

    Raises:
        InputError: fewer than four markers are seen, or they are on a line.

    """
    used = sorted(set(markers) & set(places_m))
    if len(used) < FEWEST:
        missing = ", ".join(str(marker_id) for marker_id in sorted(set(places_m) - set(used)))
        raise InputError(
            f"{len(used)} of {len(places_m)} markers are seen, {FEWEST} are needed; not seen: "
            f"{missing}: in the picture, lit, at least 14 px wide?"
        )
    px = {name: _undistorted(markers[name], lens) for name in used}
    middles = np.array([middle_of(px[name]) for name in used])
    floor = np.array([places_m[name] for name in used], dtype=float)
    for what, places in (("the picture", middles), ("markers_m", floor)):
        size = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
        if size[1] < _LEAST_SPREAD * size[0]:
            raise InputError(f"the markers lie on a line in {what}: spread them over the floor")
    homography, _ = cv2.findHomography(middles, floor)
    lens_m: Floats | None = None
    if lens is not None:
        rotation, shift = _pose(floor, middles, lens.matrix)  # six parameters instead of eight
        homography = np.linalg.inv(_over_floor((rotation, shift), lens.matrix))
        homography = homography / homography[2, 2]
        lens_m = -rotation.T @ shift
    if homography is None or not np.isfinite(homography).all():
        raise InputError("the markers fix no floor: three of four lie on a line")
    away = projected(homography, middles) - floor
    sides = {}
    for name in used:
        corners = projected(homography, px[name])
        sides[name] = float(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).mean())
    return FloorFit(
        np.asarray(homography, dtype=float),
        dict(zip(used, np.hypot(*away.T).tolist(), strict=True)),
        sides,
        lens_m,
    )


def picture_move(
    then: Markers, now: Markers, floor_from_px: Floats, matrix: Floats, lens: Lens | None
) -> PictureMove | None:
    """Move of a camera's picture, from markers seen at both times.

    A bump rotates the camera about its lens, or shifts it slightly. Outlying markers were moved on
    the floor; these must be fewer than half.

    Args:
        then: at the set-up.
        now: later.
        floor_from_px: (3, 3) of the set-up.
        matrix: (3, 3) approximate camera matrix.
        lens: its distortion is removed first.

    Returns:
        None if fewer than three markers are seen at both times.

    """
    before_px, two = (
        {name: _undistorted(px, lens) for name, px in markers.items()} for markers in (then, now)
    )
    names = sorted(set(before_px) & set(two))
    if len(names) < _FEWEST_MOVED:
        return None
    rest = list(names)
    left_out = list[int]()
    while len(rest) >= _FEWEST_MOVED:
        move = _turned_camera(matrix, before_px, two, rest)
        off_px = _residual_px(move, before_px, two, rest)
        if off_px <= _AGREE_PX:
            if off_px > _TURNED_CAMERA_PX:
                move = _moved_camera(matrix, floor_from_px, before_px, two, rest)
            return PictureMove(move, _bump(move, matrix, tuple(sorted(left_out))))
        if 2 * (len(left_out) + 1) >= len(names):
            break
        worst = min(rest, key=lambda name: _error_without(name, matrix, before_px, two, rest))
        rest.remove(worst)
        left_out.append(worst)
    move = _moved_camera(matrix, floor_from_px, before_px, two, names)
    undone = len(names) >= FEWEST and _residual_px(move, before_px, two, names) <= _TURNED_CAMERA_PX
    return PictureMove(move, replace(_bump(move, matrix, ()), undone=undone))


def _turned_camera(
    matrix: Floats, before_px: Markers, two: Markers, names: Sequence[int]
) -> Floats:
    """(3, 3) for a rotated camera: Wahba's problem by SVD."""
    rays = []
    for markers in (before_px, two):
        px = np.concatenate([markers[name] for name in names])
        ray = np.linalg.solve(matrix, np.column_stack([px, np.ones(len(px))]).T)
        rays.append(ray / np.linalg.norm(ray, axis=0))
    left, _, right = np.linalg.svd(rays[1] @ rays[0].T)
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)]) @ right
    return np.asarray(matrix @ turn @ np.linalg.inv(matrix))


def _moved_camera(
    matrix: Floats, floor_from_px: Floats, before_px: Markers, two: Markers, names: Sequence[int]
) -> Floats:
    """(3, 3) for a rotated and shifted camera: its poses over the floor, then and now."""
    before, after = (
        np.concatenate([markers[name] for name in names]) for markers in (before_px, two)
    )
    floor = projected(floor_from_px, before)
    then, now = (_pose(floor, px, matrix) for px in (before, after))
    move = _over_floor(now, matrix) @ np.linalg.inv(_over_floor(then, matrix))
    return np.asarray(move / move[2, 2])


def _error_without(
    name: int, matrix: Floats, before_px: Markers, two: Markers, names: Sequence[int]
) -> float:
    rest = [other for other in names if other != name]
    return _residual_px(_turned_camera(matrix, before_px, two, rest), before_px, two, rest)


def _residual_px(move: Floats, before_px: Markers, two: Markers, names: Sequence[int]) -> float:
    return max(
        float(np.hypot(*(projected(move, before_px[name]) - two[name]).mean(axis=0)))
        for name in names
    )


def _bump(move: Floats, matrix: Floats, left_out: tuple[int, ...]) -> Bump:
    middle = matrix[:2, 2]
    there = projected(move, middle + np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]]))
    shift = there[0] - middle
    right, down = (there[1:] - there[0]) / 10.0
    turn = float(np.arctan2(right[1] - down[0], right[0] + down[1]))
    return Bump((float(shift[0]), float(shift[1])), turn, left_out)


def _pose(floor: Floats, px: Floats, matrix: Floats) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and place (3,) of the floor in the camera's axes."""
    flat = np.column_stack([floor, np.zeros(len(floor))])
    _, turn, shift = cv2.solvePnP(flat, px, matrix, None, flags=cv2.SOLVEPNP_IPPE)
    turn, shift = cv2.solvePnPRefineLM(flat, px, matrix, None, turn, shift)
    rotation, _ = cv2.Rodrigues(turn)
    return np.asarray(rotation, dtype=float), np.asarray(shift, dtype=float).ravel()


def _over_floor(pose: tuple[Floats, Floats], matrix: Floats) -> Floats:
    """(3, 3) pixels from floor."""
    rotation, shift = pose
    return matrix @ np.column_stack([rotation[:, :2], shift])


def middle_of(corners: Floats) -> Floats:
    """Intersection of the diagonals (4, 2): the centre, also in perspective."""
    a, b, c, d = corners
    along = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    return np.asarray(a + along[0] * (c - a))


def _undistorted(px: Floats, lens: Lens | None) -> Floats:
    return px if lens is None else lens.undistorted(px)


def _dictionary() -> Any:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
