"""One frame in, one skeleton out: silhouette and medial axis against a known background."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.frame_status import FrameStatus
from snakewalk.controller.capture.image.background import (
    background_candidates,
    contrast_polarity,
    smooth_background,
)
from snakewalk.controller.capture.image.medial_axis import Skeleton, no_skeleton, skeleton_of_level
from snakewalk.controller.capture.image.silhouette import Polarity, Silhouette, silhouette_of

_LENGTH_TOLERANCE = 0.15  # of the length: frames that agree on the body's length
_BETTER = 0.04  # of the frames: by how much more must agree to leave the median


@dataclass(frozen=True, slots=True)
class Detection:
    """The body found in one frame."""

    silhouette: Silhouette
    skeleton: Skeleton
    """Its ends in no particular order; its status is that of the frame."""
    background: Image
    """(H, W[, 3]) the image that the frame was compared with."""


@dataclass(frozen=True, slots=True)
class BodyDetector:
    """Background and contrast of a scene; ``detect`` takes any frame, in any order."""

    background: Image | None
    """(H, W[, 3]) the scene without the animal; None: a smooth surface is fitted to each frame."""
    polarity: Polarity
    background_source: str
    """Where the background is from, in words."""

    def detect(self, image: Image) -> Detection:
        """Find the animal in one frame; a frame that cannot be used is not ``GOOD``.

        Raises:
            InputError: the frame is not as large as the background.

        """
        background = self.background
        if background is None:
            background = smooth_background(image)
        elif background.shape != image.shape:
            raise InputError(
                f"a frame is {_size(image)}, the background {_size(background)}: they must be alike"
            )
        body = silhouette_of(image, background, self.polarity)
        if body.status is not FrameStatus.GOOD:
            return Detection(body, no_skeleton(body.status), background)
        skeleton = skeleton_of_level(body.level, body.threshold, body.origin_px, body.noise_level)
        return Detection(body, skeleton, background)


def make_detector(frames: Sequence[Image], background: Image | None = None) -> BodyDetector:
    """Learn a scene from a few frames spread over the recording.

    Without a background the median of the frames is taken. Where the animal hardly moves, the
    median shows the animal itself; then a brighter or darker quantile of each pixel's values, or a
    smooth surface through each frame alone, is taken if more frames agree on the body's length.

    Raises:
        InputError: no frames, or the background is of another size.

    """
    if not frames:
        raise InputError("no frames to look at")
    if background is not None:
        given = BodyDetector(background, Polarity.BOTH, "given")
        given.detect(frames[0])
        return replace(given, polarity=_usual_polarity(frames, background))
    surface = BodyDetector(
        None, _usual_polarity(frames, None), "a smooth surface through each frame"
    )
    if len({frame.shape for frame in frames}) > 1 or len(frames) < 5:
        return surface
    detectors = [
        BodyDetector(
            candidate,
            _usual_polarity(frames, candidate) if polarity is None else polarity,
            source,
        )
        for candidate, polarity, source in background_candidates(frames)
    ]
    detectors.append(surface)
    scores = [_agreement(detector, frames) for detector in detectors]
    best = max(scores)
    return next(
        detector
        for detector, score in zip(detectors, scores, strict=True)
        if score >= best - _BETTER
    )


def _agreement(detector: BodyDetector, frames: Sequence[Image]) -> float:
    """Share of the frames that show a whole body of the usual length."""
    length = np.array([detector.detect(frame).skeleton.length_px for frame in frames])
    if not np.isfinite(length).any():
        return 0.0
    usual = np.nanmedian(length)
    return float(np.mean(np.abs(length - usual) < _LENGTH_TOLERANCE * usual))


def _usual_polarity(frames: Sequence[Image], background: Image | None) -> Polarity:
    """The polarity of most frames."""
    found = [
        contrast_polarity(frame, smooth_background(frame) if background is None else background)
        for frame in frames[:: max(1, len(frames) // 9)]
    ]
    return max(Polarity, key=found.count)


def _size(image: Image) -> str:
    kind = "grey" if image.ndim == 2 else "colour"
    return f"{image.shape[1]} x {image.shape[0]} {kind}"
