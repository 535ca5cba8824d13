"""One frame in, one skeleton out: silhouette and medial axis against a background."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, DeepImage, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.images.background import (
    background_candidates,
    contrast_polarity,
    median_background,
    smooth_background,
    surrounding_ground,
)
from snakewalk.controller.images.faint_parts import may_have_faint_parts, with_faint_parts
from snakewalk.controller.images.faint_tail import TailTip, with_tails
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton, skeleton_of_level
from snakewalk.controller.images.residual import check_residual, is_ghost
from snakewalk.controller.images.resting import Neighbours
from snakewalk.controller.images.silhouette import Polarity, Silhouette, silhouette_of
from snakewalk.controller.track.frame_status import FrameStatus

_HIDING = 0.5  # of the threshold: noise of single pixels hides a faint tail
_LONGER = 1.15  # times the length without a faint part: it belongs to the body; less may be dirt
_NEAR_TIP = slice(2, 6)  # stations
_THIN_END = 0.45  # of the median radius, near a tip: half of the contrast may end it too early
_LENGTH_TOLERANCE = 0.15  # of the length: frames agree on it
_BETTER_SHARE = 0.04  # of the frames: this many more must agree for another ground than the median
_FEWEST = 5  # frames to estimate a ground
_TURNS = 3  # a ground that shows no body in this part of the frames is not tried in the others
_CALM = 8  # frames whose median has little noise
_CLEAR = 0.9  # share above which no other size of the surroundings is tried
_VOTES = 9  # frames that usually decide whether the animal is dark or light
_SURE_SHARE = 0.5  # share above which a ground's body length is trusted
_FAINT = 0.5  # of the strongest contrast: a fainter body may be a stain
_PARTS = (0.015, 0.04, 0.1)  # of the smaller side: half the side of the surroundings
_ADJACENT_PX = 9  # side of a square: pixels next to a body, for the light of the ground under it
_WIDTHS = 1.5  # of the body's width: half the side of the surroundings


@dataclass(frozen=True, slots=True)
class Detection:
    """The body in one frame."""

    silhouette: Silhouette
    skeleton: Skeleton
    """Skeleton of the body with its ends in no particular order; its status is that of the
    frame."""
    background: DeepImage
    """(H, W[, 3]) the image that the frame was compared with."""
    faint_parts: bool = False
    """Whether parts of the body are much fainter than the rest; its line is then less accurate."""
    may_have_faint_parts: bool = False
    """Whether something fainter than the silhouette goes on beyond it."""
    tip: TailTip | None = None
    """Tip of a faint tail that was followed; None without one."""
    line_error_px: float | None = None
    """Expected error of a line that another program has found; None for the medial axis."""
    core_threshold: float | None = None
    """Half of the contrast of the strongest part, for a body with faint parts; None for others."""

    @property
    def contrast_threshold(self) -> float:
        """Half of the contrast of the body's strongest part."""
        return self.silhouette.threshold if self.core_threshold is None else self.core_threshold


@dataclass(frozen=True, slots=True)
class BodyDetector:
    """Background and contrast of a scene; ``detect`` accepts frames in any order."""

    background: DeepImage | None
    """(H, W[, 3]) the scene without the animal; None: the ground is found in each frame alone."""
    polarity: Polarity
    background_source: str
    """Source of the background, in words."""
    surroundings_px: int = 0
    """Side of the square whose ground a place is compared with, without a background; 0: a smooth
    surface is fitted to the frame."""
    inside: Bools | None = None
    """(H, W) where the animal may be; a body that reaches beyond is cut. None: everywhere."""
    threshold: float | None = None
    """Contrast at the body's boundary, grey levels; None: half of the body's own."""
    search_faint_parts: bool = True
    """Whether parts that are much fainter than the rest of the body belong to it."""

    def detect(
        self,
        image: DeepImage,
        ground: DeepImage | None = None,
        neighbours: Neighbours = (),
    ) -> Detection:
        """Detect the animal in one frame; the status of an unusable frame is not ``GOOD``.

        Args:
            image: (H, W[, C]).
            ground: background for this frame; None: ``ground_of`` the frame.
            neighbours: frames before and after it, for the faint tail of a resting animal.

        Raises:
            InputError: the sizes of frame and background differ.

        """
        background = self.ground_of(image) if ground is None else ground
        if background.shape != image.shape:
            raise InputError(
                f"a frame is {_size(image)}, the background {_size(background)}: they must be alike"
            )
        body = silhouette_of(image, background, self.polarity, self.threshold, wide_margin=True)
        confirmed = self._confirmed(image, background, body)
        core = _skeleton_of(confirmed)
        detection = self._checked_detection(image, background, confirmed, core)
        if self.threshold is not None:
            return detection
        faint = may_have_faint_parts(body)
        if not self.search_faint_parts:
            return replace(detection, may_have_faint_parts=faint)
        hidden = body.noise_level > _HIDING * body.threshold
        part = detection.skeleton.status is FrameStatus.PART
        may_go_on = faint or hidden or part or _has_thin_end(detection.skeleton)
        tailed = None
        if may_go_on and core.status is FrameStatus.GOOD:
            tailed = self._with_tails(image, background, body, core, neighbours)
        best = detection if tailed is None else tailed
        if faint:
            fuller = with_faint_parts(image, background, self.polarity, body)
            if fuller is not None:
                fuller = self._confirmed(image, background, fuller)
                other = self._checked_detection(image, background, fuller, _skeleton_of(fuller))
                if other.skeleton.length_px > _LONGER * np.nan_to_num(best.skeleton.length_px):
                    return replace(other, faint_parts=True, core_threshold=body.threshold)
        return best if tailed is not None else replace(detection, may_have_faint_parts=faint)

    def _confirmed(self, image: DeepImage, background: DeepImage, body: Silhouette) -> Silhouette:
        """The silhouette; its status is ``CUT`` or ``GHOST`` if the animal is not complete."""
        if body.status is not FrameStatus.GOOD:
            return body
        if self.inside is not None and (body.mask & ~self.inside[body.window()]).any():
            return replace(body, status=FrameStatus.CUT)
        if self.background is not None and is_ghost(image, background, body):
            return replace(body, status=FrameStatus.GHOST)
        return body

    def _checked_detection(
        self, image: DeepImage, background: DeepImage, body: Silhouette, skeleton: Skeleton
    ) -> Detection:
        """The body if it explains the picture around it."""
        if skeleton.status is FrameStatus.GOOD:
            ghosts = self.background is not None
            status = check_residual(image, background, self.polarity, body, skeleton, ghosts=ghosts)
            if status is not FrameStatus.GOOD:
                skeleton = no_skeleton(status)
        return Detection(body, skeleton, background)

    def _with_tails(
        self,
        image: DeepImage,
        background: DeepImage,
        body: Silhouette,
        core: Skeleton,
        neighbours: Neighbours,
    ) -> Detection | None:
        """The body with a faint tail that is thin beyond its silhouette; None without one."""
        tailed = with_tails(image, background, self.polarity, body, core, neighbours)
        if tailed is None or tailed.skeleton.length_px < _LONGER * core.length_px:
            return None
        checked = self._checked_detection(image, background, tailed.silhouette, tailed.skeleton)
        if checked.skeleton.status is not FrameStatus.GOOD:
            return None
        return replace(checked, tip=tailed.tip)

    def ground_of(self, image: DeepImage) -> DeepImage:
        """Return the background (H, W[, 3]) for a frame."""
        if self.background is not None:
            return self.background
        if self.surroundings_px:
            return surrounding_ground(image, self.polarity, self.surroundings_px)
        return smooth_background(image)


def _skeleton_of(body: Silhouette) -> Skeleton:
    if body.status is not FrameStatus.GOOD:
        return no_skeleton(body.status)
    return skeleton_of_level(body.level, body.threshold, body.origin_px, body.noise_level)


def _has_thin_end(body: Skeleton) -> bool:
    """Whether an end is much thinner than the body."""
    radius = body.radius_px
    ends = radius[_NEAR_TIP].mean(), radius[::-1][_NEAR_TIP].mean()
    return bool(min(ends) < _THIN_END * float(np.median(radius)))


def make_detector(
    frames: Sequence[DeepImage],
    background: DeepImage | None = None,
    *,
    cropped: bool = False,
    inside: Bools | None = None,
    threshold: float | None = None,
) -> BodyDetector:
    """Choose the background of a scene from a few frames spread over the recording.

    The default is the median of the frames. It shows the animal itself if the animal hardly moves
    or the camera follows it. Another ground is used if more frames then agree on the body's
    length. It is the median of frames with the animal painted out, a quantile of each pixel's
    values, or a ground
    estimated in each frame alone.

    Args:
        frames: (H, W) or (H, W, 3), 8 bit.
        background: the scene without the animal.
        cropped: the camera moves, or the frames are cropped to the animal; the ground is then
            estimated in each frame alone.
        inside: (H, W) where the animal may be.
        threshold: known contrast at the body's boundary, grey levels.

    Raises:
        InputError: no frames, or the background has another size.

    """
    if not frames:
        raise InputError("no frames to look at")
    plain = BodyDetector(None, Polarity.BOTH, "", 0, inside, threshold)
    if background is not None:
        given = replace(plain, background=background, background_source="given")
        given.detect(frames[0])
        return replace(given, polarity=usual_polarity(frames, background))
    fixed = not cropped and len(frames) >= _FEWEST and len({frame.shape for frame in frames}) == 1
    grounds = [*background_candidates(frames)] if fixed else []
    best = _learnt(replace(plain, search_faint_parts=False), frames, grounds)
    if best.share < _SURE_SHARE:
        other = _learnt(plain, frames, grounds)
        best = other if other.share > best.share + _BETTER_SHARE else best
    elif best.faint_share >= _SURE_SHARE:
        best = _best_candidate([best, _learnt(plain, frames, grounds)])
    return replace(best.detector, search_faint_parts=True)


def _learnt(
    plain: BodyDetector,
    frames: Sequence[DeepImage],
    grounds: Sequence[tuple[DeepImage, Polarity | None, str]],
) -> "_Candidate":
    """The best ground for some frames; ``grounds`` are those of ``background_candidates``."""
    surface = replace(
        plain,
        polarity=usual_polarity(frames, None),
        background_source="a smooth surface through each frame",
    )
    alone = [_Candidate.of(surface, frames)]
    around = _with_surroundings(surface, alone[0], frames)
    if around is not None:
        alone.append(_Candidate.of(around, frames))
    if not grounds:
        return _best_candidate(alone)
    median, *quantiles = [
        replace(
            plain,
            background=candidate,
            polarity=usual_polarity(frames, candidate) if polarity is None else polarity,
            background_source=source,
        )
        for candidate, polarity, source in grounds
    ]
    fixed = [median, *quantiles]
    painted = _repainted_detector(_best_candidate(alone).detector, frames)
    if painted is not None:
        fixed.insert(1, painted)
    return _best_candidate([*(_Candidate.of(detector, frames) for detector in fixed), *alone])


def whole_share(detector: BodyDetector, frames: Sequence[DeepImage]) -> float:
    """Share of the frames that show a whole body of about the usual length."""
    return _Candidate.of(detector, frames).share


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A detector and its results on some frames."""

    detector: BodyDetector
    share: float
    """Share of the frames that show a complete body of the usual length, which explains the
    picture."""
    length_px: float
    """Usual length of the body; 0 if it is unknown."""
    width_px: float
    contrast: float
    """Contrast at the boundaries of these bodies, grey levels."""
    faint_share: float
    """Share of the frames in which something fainter than the body goes on beyond it."""

    @classmethod
    def of(cls, detector: BodyDetector, frames: Sequence[DeepImage]) -> "_Candidate":
        detections: list[Detection] = []
        length = np.zeros(0)
        for start in range(_TURNS):
            detections += map(detector.detect, frames[start::_TURNS])
            bodies = [detection.skeleton for detection in detections]
            length = np.array([body.length_px for body in bodies])
            if not np.isfinite(length).any():
                return cls(detector, 0.0, 0.0, 0.0, 0.0, 0.0)
        usual = float(np.nanmedian(length))
        share = float(np.mean(np.abs(length - usual) < _LENGTH_TOLERANCE * usual))
        width = 2.0 * float(np.nanmedian([np.median(body.radius_px) for body in bodies]))
        edges = [
            detection.contrast_threshold
            for detection in detections
            if np.isfinite(detection.skeleton.length_px)
        ]
        faint = float(np.mean([detection.may_have_faint_parts for detection in detections]))
        return cls(detector, share, usual, width, float(np.median(edges)), faint)


def _best_candidate(candidates: Sequence[_Candidate]) -> _Candidate:
    """Return the first candidate with about the highest share, weighted by length.

    A part of a body has the same contrast as the whole; a longer, much fainter object is a stain.
    """
    sure = [candidate for candidate in candidates if candidate.share >= _SURE_SHARE]
    strongest = max((candidate.contrast for candidate in sure), default=0.0)
    lengths_px = [
        candidate.length_px for candidate in sure if candidate.contrast >= _FAINT * strongest
    ]
    longest = max(lengths_px, default=0.0)
    scores = [
        candidate.share * (min(1.0, candidate.length_px / longest) if longest else 1.0)
        for candidate in candidates
    ]
    best = max(scores)
    return next(
        candidate
        for candidate, score in zip(candidates, scores, strict=True)
        if score >= best - _BETTER_SHARE
    )


def _with_surroundings(
    surface: BodyDetector, candidate: _Candidate, frames: Sequence[DeepImage]
) -> BodyDetector | None:
    """Detector that compares each pixel with its surroundings; None without a polarity."""
    if surface.polarity is Polarity.BOTH:
        return None
    side = min(frames[0].shape[:2])
    tried = [2 * max(2, round(part * side)) + 1 for part in _PARTS]
    if candidate.width_px > 0.0:
        tried.insert(0, 2 * max(2, round(_WIDTHS * candidate.width_px)) + 1)
    source = "the surroundings of each place in each frame"
    candidates: list[_Candidate] = []
    for size in tried:
        detector = replace(surface, background_source=source, surroundings_px=size)
        candidates.append(_Candidate.of(detector, frames[:: max(1, len(frames) // 9)]))
        if candidates[-1].share >= _CLEAR:
            break
    return _best_candidate(candidates).detector


def _repainted_detector(detector: BodyDetector, frames: Sequence[DeepImage]) -> BodyDetector | None:
    """Detector with the median of painted-out frames; None if too few are usable."""
    out = []
    for frame in frames:
        detection = detector.detect(frame)
        if detection.skeleton.status is not FrameStatus.GOOD:
            continue
        body = detection.silhouette
        reach = 2 * round(0.5 * float(np.median(detection.skeleton.radius_px)) + 2.0) + 1
        cover = np.zeros(frame.shape[:2], dtype=np.uint8)
        cover[body.window()] = body.mask
        cover = np.asarray(cv2.dilate(cover, np.ones((reach, reach), np.uint8)), dtype=np.uint8)
        out.append(_with_ground(frame, detection.background, cover))
    if len(out) < max(_CALM, len(frames) // 2):
        return None
    ground = median_background(out)
    return replace(
        detector,
        background=ground,
        background_source="the median of frames, the animal painted out of each",
        surroundings_px=0,
    )


def _with_ground(frame: DeepImage, ground: DeepImage, cover: Image) -> DeepImage:
    """The frame (H, W[, C]) with its ground where ``cover`` (H, W) is above 0.

    The surroundings of a place are lighter than a patterned ground (darker for a light animal), so
    the difference next to the cover is added.
    """
    is_adjacent = cv2.dilate(cover, np.ones((_ADJACENT_PX, _ADJACENT_PX), np.uint8)) > cover
    difference = frame[is_adjacent].astype(float) - ground[is_adjacent]
    filled = ground[cover > 0] + (np.median(difference, axis=0) if is_adjacent.any() else 0.0)
    out = frame.copy()
    if frame.dtype == np.uint8:
        filled = np.clip(np.rint(filled), 0.0, 255.0)
    out[cover > 0] = filled.astype(frame.dtype)
    return out


def usual_polarity(frames: Sequence[DeepImage], background: DeepImage | None) -> Polarity:
    """Return the polarity of most frames in which something stands out.

    If the background shows the animal, frames stand out both ways; each frame alone then decides.
    """
    usual = _most_frequent(frames, background)
    if background is not None and usual is Polarity.BOTH:
        return _most_frequent(frames, None)
    return usual


def stands_out_both_ways(frames: Sequence[DeepImage]) -> bool:
    """Whether most frames are darker than their median in places, and lighter in others.

    An animal as bright as its ground shows only its pattern in this way.
    """
    alike = len({frame.shape for frame in frames}) == 1
    ground = median_background(frames) if alike else None
    return _most_frequent(frames, ground) is Polarity.BOTH


def _most_frequent(frames: Sequence[DeepImage], background: DeepImage | None) -> Polarity:
    few = frames[:: max(1, len(frames) // _VOTES)]
    for some in (few, frames):  # the animal may be absent in all of the few
        polarities = [
            contrast_polarity(frame, smooth_background(frame) if background is None else background)
            for frame in some
        ]
        if any(polarities):
            break
    return max(Polarity, key=polarities.count) if any(polarities) else Polarity.BOTH


def _size(image: DeepImage) -> str:
    kind = "grey" if image.ndim == 2 else "colour"
    return f"{image.shape[1]} x {image.shape[0]} {kind}"
