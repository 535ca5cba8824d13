"""Detections of a film, frame by frame, as the capture of the whole film needs them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.controller.capture.coil_fit import COILS, Outline
from snakewalk.controller.capture.image_file import ImageFile
from snakewalk.controller.capture.small_body.blur_estimate import axis_error_px, edge_blur_px
from snakewalk.controller.capture.small_body.crop import LONGEST_PX, CropStore
from snakewalk.controller.capture.small_body.tip_profile import NO_ENDS, profile_ends
from snakewalk.controller.capture.verification.frame_store import FrameStore
from snakewalk.controller.images.body_detector import Detection
from snakewalk.controller.images.faint_tail import TailTip
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_LOST_FRAMES = 5  # for this number of frames a lost small body is searched at its last place
_FAINT_PARTS = 2.5  # times the error of an even body; measured on rendered films
_BAND = 0.6  # of the longest light band: another one may be hidden beyond a thin tail, which
# shifts the points by half of its length in the mean; blur shortens the band that is seen
_WITHOUT_OUTLINE = {FrameStatus.NOTHING, FrameStatus.CUT, FrameStatus.MERGED}
_CLEAR_FRAMES = 0.5  # of the frames with an outline
_NOISY = 0.35  # of half of the contrast: pattern and noise of the ground break outlines (measured)
_HIDDEN_PART = 0.1  # of the length: error if half of the contrast of the faint parts is only noise
# because a tail that fades into the noise goes on beyond its visible end (measured on larvae)


@dataclass(slots=True)
class Detections:
    """One entry a frame, as the detector found it."""

    skeletons: list[Skeleton] = field(default_factory=list)
    area_px: list[float] = field(default_factory=list)
    contrast: list[float] = field(default_factory=list)
    """Half of the contrast of the clearest region, grey levels; 0 if the frame is skipped."""
    noise: list[float] = field(default_factory=list)
    """Noise of the silhouette over its threshold; 0 without a silhouette."""
    distractors: list[float] = field(default_factory=list)
    expected_px: list[float] = field(default_factory=list)
    """Error of long bodies, whose medial axis is kept; NaN for all others."""
    axis_error_px: list[float] = field(default_factory=list)
    """Error of the medial axis of any body; NaN for a frame without one."""
    outlines: dict[int, Outline] = field(default_factory=dict)
    """By frame: silhouettes of bodies that are whole, also those that touch themselves; none of a
    body with a faint tail, which no coil's outline shows."""
    faint_error_px: dict[int, float] = field(default_factory=dict)
    """By frame: least expected error of bodies with faint parts, apart from hidden bands."""
    tips: dict[int, TailTip] = field(default_factory=dict)
    """By frame: tip of a faint tail that was followed."""
    bands_px: list[float] = field(default_factory=list)
    """Longest light band of each body with faint parts."""
    ends_px: list[Floats] = field(default_factory=list)
    """(2, 3) by frame: where the profile of the body ends, and the doubt; NaN if not known."""
    file: ImageFile = field(default_factory=ImageFile)
    """File of the pictures that are kept."""
    store: FrameStore = field(init=False)
    """Surroundings of the body in every frame."""
    crops: CropStore = field(init=False)
    """By frame: small bodies, and where a small body was lost its last place."""
    stated_s: list[float] = field(default_factory=list)
    """Times of the frames, as the film states them."""
    _last: int = -_LOST_FRAMES - 1
    _points: Floats = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        """Put the pictures into one file."""
        self.store, self.crops = FrameStore(self.file), CropStore(self.file)

    def add(self, frame: DeepImage, detection: Detection) -> None:
        """Add the next frame (H, W[, C]); crops of small bodies are kept for their fit."""
        number = len(self.skeletons)
        body = detection.skeleton
        silhouette = detection.silhouette
        self.skeletons.append(body)
        line_px = detection.line_error_px
        area_px = silhouette.area_px
        if line_px is not None:
            area_px = 2.0 * float(body.radius_px.mean()) * body.length_px
        self.area_px.append(area_px)
        self.contrast.append(silhouette.threshold)
        is_visible = silhouette.area_px > 0.0
        self.noise.append(silhouette.noise_level / silhouette.threshold if is_visible else 0.0)
        self.distractors.append(silhouette.distractors)
        expected = axis_px = np.nan
        ends_px = NO_ENDS
        is_tailed = detection.tip is not None
        if line_px is not None:
            axis_px = line_px
        elif body.status is FrameStatus.GOOD:
            blur_px = edge_blur_px(silhouette.level, silhouette.threshold)
            axis_px = axis_error_px(blur_px, body.length_px)
            if detection.tip is not None:
                self.tips[number] = detection.tip
            else:
                first = np.asarray(silhouette.origin_px)
                line = body.points_px - first
                ends_px = profile_ends(line, body.radius_px, silhouette.level, blur_px)
                ends_px[:, :2] += first
            if detection.faint_parts:
                hidden = min(1.0, silhouette.noise_level / max(silhouette.threshold, 1e-9))
                axis_px = max(_FAINT_PARTS * axis_px, _HIDDEN_PART * hidden**2 * body.length_px)
                self.bands_px.append(_longest_band_px(body, detection))
                self.faint_error_px[number] = axis_px
        is_whole = body.status is FrameStatus.GOOD and not is_tailed
        if silhouette.status is FrameStatus.GOOD and (is_whole or body.status in COILS):
            width_px = 2.0 * float(np.max(body.radius_px))
            self.outlines[number] = Outline.of(silhouette, np.nan_to_num(width_px))
        self._keep_surroundings(number, frame, detection)
        is_clear = line_px is None and not (detection.faint_parts or is_tailed)
        if body.length_px <= LONGEST_PX and is_clear:
            self._last = number
            self._points = body.points_px
            self.crops.put(number, frame, detection.background, self._points)
        elif body.status is FrameStatus.GOOD:
            expected = axis_px
        elif body.status is FrameStatus.BLOB and number - self._last <= _LOST_FRAMES:
            self.crops.put(number, frame, detection.background, self._points)
        self.expected_px.append(expected)
        self.axis_error_px.append(axis_px)
        self.ends_px.append(ends_px)

    def is_unclear(self, skeletons: Sequence[Skeleton]) -> bool:
        """Whether the noise is large, and fewer than half of the outlines are used.

        Args:
            skeletons: of all frames, at the end.

        """
        used = sum(skeleton.status.has_points for skeleton in skeletons)
        noise = [
            level
            for level, skeleton in zip(self.noise, skeletons, strict=True)
            if skeleton.status not in _WITHOUT_OUTLINE
        ]
        return used < _CLEAR_FRAMES * len(noise) and float(np.median(noise)) > _NOISY

    def shows_tips(self, skeletons: Sequence[Skeleton]) -> bool:
        """Whether most tips are those of followed tails: nothing is seen beyond them."""
        return len(self.tips) > 0.5 * sum(skeleton.status.has_points for skeleton in skeletons)

    @property
    def least_error_px(self) -> dict[int, float]:
        """By frame: least expected error of bodies with faint parts."""
        band_px = _BAND * float(np.median(self.bands_px)) if self.bands_px else 0.0
        return {k: max(error_px, band_px) for k, error_px in self.faint_error_px.items()}

    def skip(self, status: FrameStatus) -> None:
        """Add a frame in which the animal is not searched for."""
        self.skeletons.append(no_skeleton(status))
        for values in (self.area_px, self.noise, self.contrast, self.distractors):
            values.append(0.0)
        for errors in (self.expected_px, self.axis_error_px):
            errors.append(np.nan)
        self.ends_px.append(NO_ENDS)

    def _keep_surroundings(self, number: int, frame: DeepImage, detection: Detection) -> None:
        """Keep the surroundings of the silhouette and of the last place of a small body."""
        body = detection.silhouette
        corner = np.array([body.origin_px, np.add(body.origin_px, body.level.shape[::-1])])
        places = np.vstack([corner, self._points]) if body.area_px > 0.0 else self._points
        if detection.skeleton.status is FrameStatus.GOOD:
            places = np.vstack([places, detection.skeleton.points_px])
        if len(places):
            length = float(np.nan_to_num(detection.skeleton.length_px))
            self.store.put(number, frame, places, length)


def _longest_band_px(body: Skeleton, detection: Detection) -> float:
    """Length of the longest faint part of a body that has stronger parts on both sides."""
    level = detection.silhouette.level
    pixel = np.rint(body.points_px - np.asarray(detection.silhouette.origin_px)).astype(int)
    column, row = np.clip(pixel, 0, np.subtract(level.shape[::-1], 1)).T
    strong = np.flatnonzero(level[row, column] >= detection.contrast_threshold)
    chord = body.length_px / (len(body.points_px) - 1)
    return float(np.diff(strong).max(initial=1) - 1) * chord
