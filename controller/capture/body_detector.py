"""One frame in, one skeleton out: silhouette and medial axis with what is known of the ground."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.frame_status import Verdict
from snakewalk.controller.capture.image.background import (
    look_of,
    smooth_background,
    spread_backgrounds,
)
from snakewalk.controller.capture.image.medial_axis import Skeleton, no_skeleton, skeleton_of_level
from snakewalk.controller.capture.image.silhouette import Look, Silhouette, silhouette_of

_ALIKE = 0.15  # of the length: frames that agree on the body's length
_BETTER = 0.04  # of the frames: by how much more must agree to leave the median


@dataclass(frozen=True, slots=True)
class Seen:
    """What one frame shows."""

    silhouette: Silhouette
    skeleton: Skeleton
    """Its ends in no particular order; its verdict holds for the frame."""
    ground: Image
    """(H, W[, 3]) what the frame was compared with."""


@dataclass(frozen=True, slots=True)
class Eye:
    """What is known of a scene; ``see`` may be called for any frame, in any order."""

    background: Image | None
    """(H, W[, 3]) the scene without the animal; None: a smooth surface is fitted to each frame."""
    look: Look
    how: str
    """Where the background is from, in words."""

    def see(self, image: Image) -> Seen:
        """Find the animal of one frame; what cannot be used has a verdict other than ``GOOD``.

        Raises:
            InputError: the frame is not as large as the background.

        """
        ground = self.background
        if ground is None:
            ground = smooth_background(image)
        elif ground.shape != image.shape:
            raise InputError(
                f"a frame is {_size(image)}, the background {_size(ground)}: they must be alike"
            )
        body = silhouette_of(image, ground, self.look)
        if body.verdict is not Verdict.GOOD:
            return Seen(body, no_skeleton(body.verdict), ground)
        skeleton = skeleton_of_level(body.level, body.threshold, body.origin_px, body.least)
        return Seen(body, skeleton, ground)


def open_eye(frames: Sequence[Image], background: Image | None = None) -> Eye:
    """Learn a scene from a few frames spread over the recording.

    Without a background the median is taken; where the animal hardly moves, what was there most
    of the time is the animal, and a brighter or darker part of the values seen at each place, or
    a smooth surface through each frame alone, lets more frames agree on the body's length.

    Raises:
        InputError: no frames, or the background is of another size.

    """
    if not frames:
        raise InputError("no frames to look at")
    if background is not None:
        plain = Eye(background, Look.BOTH, "given")
        plain.see(frames[0])
        return replace(plain, look=_look(frames, background))
    surface = Eye(None, _look(frames, None), "a smooth surface through each frame")
    if len({frame.shape for frame in frames}) > 1 or len(frames) < 5:
        return surface
    tried = [
        Eye(ground, _look(frames, ground) if look is None else look, how)
        for ground, look, how in spread_backgrounds(frames)
    ]
    tried.append(surface)
    marks = [_agreeing(eye, frames) for eye in tried]
    best = max(marks)
    return next(eye for eye, mark in zip(tried, marks, strict=True) if mark >= best - _BETTER)


def _agreeing(eye: Eye, frames: Sequence[Image]) -> float:
    """Part of the frames that show a whole body of the usual length."""
    length = np.array([eye.see(frame).skeleton.length_px for frame in frames])
    if not np.isfinite(length).any():
        return 0.0
    usual = np.nanmedian(length)
    return float(np.mean(np.abs(length - usual) < _ALIKE * usual))


def _look(frames: Sequence[Image], background: Image | None) -> Look:
    """What most frames say."""
    said = [
        look_of(frame, smooth_background(frame) if background is None else background)
        for frame in frames[:: max(1, len(frames) // 9)]
    ]
    return max(Look, key=said.count)


def _size(image: Image) -> str:
    kind = "grey" if image.ndim == 2 else "colour"
    return f"{image.shape[1]} x {image.shape[0]} {kind}"
