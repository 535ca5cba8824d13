"""A camera above the floor: from a frame to the body's line in the world.

The floor maps to the image by one homography. The image shows the body's outline, at the height of
its axis. From a lens at height ``h`` above the foot ``f``, a point at height ``z`` covers the floor
farther out, at ``g = f + (p - f) h / (h - z)``; this is inverted.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Self

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image, Singles
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.body_contrast import (
    DEEP_SHADE,
    BodyContrast,
    confirmed,
    links_at,
)
from snakewalk.controller.cameras.floor_light import grey_of, lit_floor, unexplained
from snakewalk.controller.cameras.ground_rest import Heights
from snakewalk.controller.cameras.lens import Lens, projected
from snakewalk.controller.cameras.markers.floor_markers import (
    Bump,
    Markers,
    PictureMove,
    find_markers,
    fit_floor,
    picture_move,
)
from snakewalk.controller.cameras.markers.lens_residual import (
    Distortion,
    assumed_distortion,
    marker_distortion,
)
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose, track_pose
from snakewalk.controller.images.body_detector import BodyDetector, Detection
from snakewalk.controller.images.medial_axis import no_skeleton, skeleton_of
from snakewalk.controller.images.silhouette import Polarity, silhouette_of
from snakewalk.controller.track.frame_status import FrameStatus

_SHADOW = 0.02
_LARGE_SHADOW = 0.05  # of the body's area: dark and colourless next to it (ours)
_SURROUNDINGS = 0.25  # of the picture's width: a square in which the body is small
_MOVED_CAMERA_PX, _FURTHEST_PX = 0.5, 24  # of a bumped camera's picture
_SCALE_DOWN = 2  # reduction of the picture to match the floor
_PARTS = 6, 4  # of a picture, across and down
_BETTER_RESIDUAL = 0.8  # share of a part's squared residual, if a move explains it (ours)
_LEAST_PARTS = 3
_LEAST_LIKENESS = 0.2  # correlation of two floor pictures, noise and robot included (ours)
_SURFACE_ROUNDS = 6
"""Rounds in which the ray of a pixel meets the ground: on 30 degrees each leaves a third (ours)."""
MISPLACED_M = 0.03
"""A marker that lies further from its measured place fixes no floor (ours)."""
_LEAST_AREA = 0.01  # of the image: four corners that span less fix no plane


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Map from pixels to the floor, and to a level plane above it."""

    floor_from_px: Floats
    """(3, 3) homography, pixels (x right, y down, whole at the centre of a pixel) to metres."""
    foot_m: Floats
    """(2,) floor below the lens."""
    height_m: float
    """Height of the lens above the floor."""
    lens: Lens | None = None
    """Lens of the camera; if it distorts, the homography is of pixels without distortion."""
    moved_px: tuple[float, float] = (0.0, 0.0)
    """Shift of the picture in x and y since the homography was measured."""
    markers: Markers = field(default_factory=dict)
    """Printed markers in the picture in which the homography was measured."""
    distortion: Distortion | None = None
    """Distortion of an uncalibrated lens that markers show, or that four corners do not exclude; it
    is not undone."""
    heights: Heights | None = None
    """Heights of known ground above the floor of the homography; None: the ground is that floor."""

    @classmethod
    def of_floor(
        cls,
        camera: CameraConfig,
        centre_m: tuple[float, float],
        lens: Lens | None,
        background: Image,
    ) -> Self:
        """Build the model from the floor's markers, or without markers a vertical camera.

        Raises:
            InputError: as ``from_markers``.

        """
        if camera.markers_m is not None:
            return cls.from_markers(camera, centre_m, lens, background)
        return cls.straight_down(camera, centre_m, lens)

    @classmethod
    def straight_down(
        cls, camera: CameraConfig, centre_m: tuple[float, float], lens: Lens | None = None
    ) -> Self:
        """Build the model of a vertical pinhole camera above ``centre_m``."""
        scale = camera.field_width_m / camera.width_px
        c, s = scale * np.cos(camera.turn_rad), scale * np.sin(camera.turn_rad)
        x, y = 0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)
        floor = np.eye(3)
        floor[:2, :2] = [[c, s], [s, -c]]  # the image's y points down
        floor[:2, 2] = centre_m[0] - (c * x + s * y), centre_m[1] - (s * x - c * y)
        return cls(floor, np.array(centre_m, dtype=float), camera.height_m, lens)

    @classmethod
    def from_corners(
        cls, camera: CameraConfig, centre_m: tuple[float, float], lens: Lens | None = None
    ) -> Self:
        """Build the model from four places known in the image and on the floor.

        Raises:
            InputError: places are missing, or three are on a line.

        """
        if camera.corners_px is None or camera.corners_m is None:
            raise InputError("camera: corners_px and corners_m are needed")
        px = np.array(camera.corners_px, dtype=np.float32)
        if lens is not None:
            px = lens.undistorted(px.astype(float)).astype(np.float32)
        floor = np.array(camera.corners_m, dtype=np.float32)
        for name, corners, area in (
            ("corners_px", px, float(camera.width_px * camera.height_px)),
            ("corners_m", floor, float(np.ptp(floor, axis=0).prod())),
        ):
            if _least_triangle(corners) < _LEAST_AREA * area or area == 0.0:
                raise InputError(f"camera: {name}: three of the four places lie on a line")
        found = np.asarray(cv2.getPerspectiveTransform(px, floor), dtype=float)
        size_px = camera.width_px, camera.height_px
        distortion = None if lens else assumed_distortion(px, floor, size_px)
        foot = np.array(centre_m, dtype=float)
        return cls(found, foot, camera.height_m, lens, distortion=distortion)

    @classmethod
    def from_markers(
        cls,
        camera: CameraConfig,
        centre_m: tuple[float, float],
        lens: Lens | None,
        background: Image,
    ) -> Self:
        """Build the model from printed markers in a picture of the empty floor.

        With a known lens the markers give its height and foot.

        Raises:
            InputError: too few are seen, they are on a line, or one is off its measured place.

        """
        places = camera.marker_places_m
        markers = {name: px for name, px in find_markers(background).items() if name in places}
        try:
            fit = fit_floor(markers, places, lens)
        except InputError as fault:
            raise InputError(f"camera: markers_m: {fault}") from None
        size_px = (background.shape[1], background.shape[0])
        side_m = camera.marker_side_m
        distortion = None if lens else marker_distortion(markers, places, size_px, side_m)
        if distortion is not None and not distortion.is_certain:
            distortion = None
        worst = max(fit.residual_m, key=lambda name: fit.residual_m[name])
        if fit.residual_m[worst] > MISPLACED_M:
            cause = "is its place right, or another's?" if distortion is None else str(distortion)
            raise InputError(
                f"camera: markers_m: marker {worst} lies {1e3 * fit.residual_m[worst]:.0f} mm from "
                f"where it must be by the others: {cause}"
            )
        foot = np.array(centre_m, dtype=float)
        height = camera.height_m
        if fit.lens_m is not None:
            foot = fit.lens_m[:2]
            height = float(fit.lens_m[2])
        return cls(fit.floor_from_px, foot, height, lens, markers=markers, distortion=distortion)

    def matrix(self, size_px: tuple[int, int]) -> Floats:
        """(3, 3) camera matrix; without a lens, that of a pinhole at this height."""
        if self.lens is not None:
            return self.lens.matrix
        middle = 0.5 * (np.array(size_px, dtype=float) - 1.0)
        places = projected(
            self.floor_from_px, middle + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        )
        across, down = places[1:] - places[0]
        metre_px = 1.0 / np.sqrt(abs(across[0] * down[1] - across[1] * down[0]))
        focal = self.height_m * metre_px
        return np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])

    def on_plane(self, points_px: Floats, z_m: float) -> Floats:
        """(..., 2) world places of pixels (..., 2) of points ``z_m`` above the ground."""
        plain = points_px - self.moved_px
        if self.lens is not None:
            plain = self.lens.undistorted(plain)
        floor = projected(self.floor_from_px, plain)
        out_m = floor - self.foot_m
        places = self.foot_m + out_m * (1.0 - z_m / self.height_m)
        if self.heights is None:
            return np.asarray(places)
        for _ in range(_SURFACE_ROUNDS):  # the ray of the pixel meets the ground
            share = 1.0 - (self.heights(places) + z_m) / self.height_m
            places = self.foot_m + out_m * share[..., None]
        return np.asarray(places)

    def in_image(self, points_m: Floats, z_m: float) -> Floats:
        """(..., 2) pixels of world places (..., 2) ``z_m`` above the ground."""
        return self.projection(z_m)(points_m)

    def projection(self, z_m: float) -> Callable[[Floats], Floats]:
        """``in_image`` at one height, for many calls."""
        if self.heights is not None:
            return self._projection_on(self.heights, z_m)
        grow = 1.0 / (1.0 - z_m / self.height_m)
        onto_floor = np.diag([grow, grow, 1.0])  # a higher point covers the floor farther out
        onto_floor[:2, 2] = self.foot_m * (1.0 - grow)
        back = np.asarray(np.linalg.inv(self.floor_from_px) @ onto_floor, dtype=float)
        lens = self.lens
        moved_px = np.array(self.moved_px)

        def project(points_m: Floats) -> Floats:
            plain = projected(back, points_m)
            return np.asarray((plain if lens is None else lens.distorted(plain)) + moved_px)

        return project

    def _projection_on(self, heights: Heights, z_m: float) -> Callable[[Floats], Floats]:
        """``projection`` on uneven ground."""
        back = np.linalg.inv(self.floor_from_px)
        moved_px = np.array(self.moved_px)

        def project(points_m: Floats) -> Floats:
            share = 1.0 - (heights(points_m) + z_m) / self.height_m
            plain = projected(back, self.foot_m + (points_m - self.foot_m) / share[..., None])
            distorted = plain if self.lens is None else self.lens.distorted(plain)
            return np.asarray(distorted + moved_px)

        return project


@dataclass(frozen=True, slots=True)
class LineDetection:
    """The body's line in one frame."""

    time_s: float
    """Time at which the image was taken."""
    line_m: Floats
    """(101, 2) axis of the body in the world from tip to tip, which end first is not known; NaN
    where the frame shows no whole body."""
    status: FrameStatus


@dataclass(frozen=True, slots=True)
class OverheadDetector:
    """Camera, empty floor and height of the body's axis."""

    model: CameraModel
    background: Image
    axis_height_m: float
    shade: float = 0.0
    """Largest share of the floor's light that the body's shadow removes: a pixel that is darker by
    less is still floor."""
    bump: Bump | None = None
    """Bump of the camera since its floor was pictured."""
    first: Self | None = None
    """Camera before any bump that markers showed."""
    pictured: Image | None = None
    """The floor as it was pictured, if ``background`` has been learnt since: an object may be
    removed again, and either picture is floor."""

    def detect(self, image: Image, time_s: float) -> LineDetection:
        """Find the body in one frame (H, W[, 3]).

        Raises:
            InputError: the frame's size differs from the background's.

        """
        skeleton = self.detect_px(image).skeleton
        line = self.model.on_plane(skeleton.points_px, self.axis_height_m)
        return LineDetection(time_s, line, skeleton.status)

    def registered(self, image: Image) -> Self:
        """Return the detector for a bumped camera; itself if the floor has not moved.

        Printed markers also measure rotations and tilts. With fewer than three in view the floor's
        own texture is matched (tiles, joints). A floor without texture gives no result.

        Raises:
            InputError: the frame's size differs from the background's.

        """
        self._check_size(image)
        first = self.first or self
        if first.model.markers:
            size_px = image.shape[1], image.shape[0]
            model = first.model
            move = picture_move(
                model.markers,
                find_markers(image),
                model.floor_from_px,
                model.matrix(size_px),
                model.lens,
            )
            if move is not None:
                return self._moved_by_markers(first, move, size_px)
        return self._moved_by_texture(image)

    def _moved_by_markers(self, first: Self, move: PictureMove, size_px: tuple[int, int]) -> Self:
        reference = self.bump or Bump((0.0, 0.0))
        now = move.bump
        corners = np.array(
            [[0.0, 0.0], [size_px[0], 0.0], [0.0, size_px[1]], list(size_px)], dtype=float
        )
        floor_from_px = first.model.floor_from_px @ np.linalg.inv(move.present_from_earlier)
        back = np.linalg.inv(self.model.floor_from_px) @ floor_from_px
        off = np.hypot(*(projected(back, corners) - corners + self.model.moved_px).T)
        is_unchanged = reference.left_out == now.left_out and reference.undone == now.undone
        if is_unchanged and off.max() < (_MOVED_CAMERA_PX if now.undone else np.inf):
            return self
        if not now.undone:
            return replace(self, bump=now, first=first)
        model = replace(first.model, floor_from_px=floor_from_px)
        columns, rows = size_px
        grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(float)
        lens = first.model.lens
        then = projected(
            np.linalg.inv(move.present_from_earlier),
            grid if lens is None else lens.undistorted(grid),
        )
        places_px = (then if lens is None else lens.distorted(then)).astype(np.float32)
        ground = np.asarray(
            cv2.remap(
                first.background,
                places_px[..., 0],
                places_px[..., 1],
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            dtype=np.uint8,
        )
        return replace(self, model=model, background=ground, bump=now, first=first, pictured=None)

    def _moved_by_texture(self, image: Image) -> Self:
        """Detector with the best shift of the floor's texture.

        Moving objects cover parts of the picture, so the move must improve three parts more than it
        worsens.
        """
        floor, now = (_texture(picture) for picture in (self.background, image))
        far = _FURTHEST_PX // _SCALE_DOWN
        likeness = cv2.matchTemplate(now, floor[far:-far, far:-far], cv2.TM_CCOEFF_NORMED)
        _, best, _, (column, row) = cv2.minMaxLoc(likeness)
        if best < _LEAST_LIKENESS or not (0 < column < 2 * far and 0 < row < 2 * far):
            return self
        x, y = (
            _SCALE_DOWN * (k - far + _peak(np.asarray(line[k - 1 : k + 2], dtype=float)))
            for k, line in ((column, likeness[row]), (row, likeness[:, column]))
        )
        if np.hypot(x, y) < _MOVED_CAMERA_PX:
            return self
        old = self.model.moved_px
        columns, rows = image.shape[1], image.shape[0]

        def shifted(ground: Image) -> Image:
            return np.asarray(
                cv2.warpAffine(
                    ground,
                    np.array([[1.0, 0.0, x], [0.0, 1.0, y]]),
                    (columns, rows),
                    flags=cv2.INTER_LINEAR,
                    borderMode=cv2.BORDER_REPLICATE,
                ),
                dtype=np.uint8,
            )

        moved = shifted(self.background)
        if _parts_explained(now, floor, _texture(moved)) < _LEAST_PARTS:
            return self
        away = old[0] + x, old[1] + y
        model = replace(self.model, moved_px=away)
        pictured = None if self.pictured is None else shifted(self.pictured)
        return replace(self, model=model, background=moved, bump=Bump(away), pictured=pictured)

    def track(
        self, image: Image, time_s: float, prior: BodyPrior, robot: RobotConfig
    ) -> TrackedPose:
        """Find the robot in one frame near its expected place only.

        Raises:
            InputError: the frame's size differs from the background's.

        """
        self._check_size(image)
        floors = [self.background] if self.pictured is None else [self.background, self.pictured]
        to_px = self.model.projection(self.axis_height_m)
        contrast = BodyContrast.around(image, floors, to_px, prior, robot)
        tracked_pose = track_pose(robot, contrast.standing_out(self.shade), prior, time_s)
        shadow = contrast.hard_shadow(links_at(prior, tracked_pose), self.shade)
        if shadow > _SHADOW:
            tracked_pose = _next_to_shadow(robot, contrast, prior, tracked_pose, shadow)
        tracked_pose = confirmed(robot, contrast, prior, tracked_pose, self.shade)
        if self.bump is not None and not self.bump.undone:
            return replace(tracked_pose, fault=str(self.bump), bump=self.bump)
        px = self.model.in_image(prior.links_m, self.axis_height_m)
        within = (px >= 0.0) & (px <= np.array(image.shape[1::-1]) - 1.0)
        fault = (
            str(FrameStatus.CUT) if tracked_pose.fault and not within.all() else tracked_pose.fault
        )
        covariance = tracked_pose.covariance
        if self.model.distortion is not None:
            covariance = covariance + self.model.distortion.covariance
        return replace(tracked_pose, fault=fault, bump=self.bump, covariance=covariance)

    def _check_size(self, image: Image) -> None:
        floor = self.background
        if image.shape != floor.shape:
            sizes = " and ".join(
                f"{picture.shape[1]} x {picture.shape[0]}" for picture in (image, floor)
            )
            raise InputError(f"frame and background must be alike, they are {sizes} pixels")

    def detect_px(self, image: Image) -> Detection:
        """Silhouette and skeleton of a frame, in pixels.

        Raises:
            InputError: the frame's size differs from the background's.

        """
        difference = self._difference_from_floor(image)
        return BodyDetector(np.zeros_like(difference), Polarity.BOTH, "given").detect(difference)

    def outline(self, image: Image, time_s: float) -> LineDetection:
        """Find the body in one frame (H, W[, 3]) by its outline only, in a tenth of the time.

        Raises:
            InputError: the frame's size differs from the background's.

        """
        difference = self._difference_from_floor(image)
        body = silhouette_of(difference, np.zeros_like(difference), Polarity.BOTH)
        good = body.status is FrameStatus.GOOD
        skeleton = skeleton_of(body.mask) if good else no_skeleton(body.status)
        points = skeleton.points_px + body.origin_px
        line = self.model.on_plane(points, self.axis_height_m)
        return LineDetection(time_s, line, skeleton.status)

    def _difference_from_floor(self, image: Image) -> Image:
        """(H, W) grey levels of a frame's difference from its floor."""
        self._check_size(image)
        floor = self.background
        lit = lit_floor(image, floor, 0.5 * (_SURROUNDINGS * image.shape[1]) ** 2)
        return np.minimum(unexplained(image, lit, self.shade), 255.0).astype(np.uint8)


def _next_to_shadow(
    robot: RobotConfig,
    contrast: BodyContrast,
    prior: BodyPrior,
    tracked: TrackedPose,
    shadow: float,
) -> TrackedPose:
    """Find a body next to a hard shadow by its colour.

    A colourless body may be the shadow, so its place is rejected.
    """
    by_colour = track_pose(robot, contrast.standing_out(DEEP_SHADE), prior, tracked.time_s)
    if not by_colour.fault:
        compressed = contrast.compression is not None  # blocks of colour may look like a shadow
        better = compressed and not tracked.fault and tracked.error_m < by_colour.error_m
        return tracked if better else by_colour
    if tracked.fault or shadow < _LARGE_SHADOW:
        return tracked
    return replace(tracked, fault="a hard shadow near the body has its colour; soften the light")


def _texture(image: Image) -> Singles:
    """(H / 2, W / 2) edges of a picture, without slow changes of light."""
    grey = grey_of(image)
    half = grey.shape[1] // _SCALE_DOWN, grey.shape[0] // _SCALE_DOWN
    small = cv2.resize(grey, half, interpolation=cv2.INTER_AREA).astype(np.float32)
    fine, coarse = (cv2.GaussianBlur(small, (0, 0), reach) for reach in (1.0, 4.0))
    return np.asarray(np.clip(fine - coarse, -8.0, 8.0), dtype=np.float32)


def _parts_explained(now: Singles, floor: Singles, moved: Singles) -> int:
    far = _FURTHEST_PX // _SCALE_DOWN
    before, after = (
        cv2.resize(((now - texture) ** 2)[far:-far, far:-far], _PARTS, interpolation=cv2.INTER_AREA)
        for texture in (floor, moved)
    )
    better = after < _BETTER_RESIDUAL * before
    worse = before < _BETTER_RESIDUAL * after
    return int(better.sum()) - int(worse.sum())


def _peak(values: Floats) -> float:
    """Offset of the vertex of the parabola through three values from the middle one."""
    bend = float(values[0] - 2.0 * values[1] + values[2])
    return 0.0 if bend >= 0.0 else 0.5 * float(values[0] - values[2]) / bend


def _least_triangle(corners: Singles) -> float:
    areas = []
    for out in range(4):
        a, b, c = np.delete(corners, out, axis=0).astype(float)
        (ux, uy), (vx, vy) = b - a, c - a
        areas.append(0.5 * abs(ux * vy - uy * vx))
    return float(min(areas))
