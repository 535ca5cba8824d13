"""The silhouette of one animal: where a frame differs from its background ([PT] 2.2)."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, DeepImage, Int32s, Singles
from snakewalk.controller.track.frame_status import FrameStatus

_MARGIN = 4
_WIDE_MARGIN = 20
_CLEAR = 6.0  # standard deviations of the noise: contrast of an animal's pixel
_LEAST_AREA_PX = 12
_MOST_LABELS = 65_535  # of two bytes
_RIVAL = 0.4  # of the largest body's size: a larger object is a second animal, not dirt
_CANDIDATES = 4  # number of parts that may be the animal
_SHARE = 0.4  # quantile, weighted by squared contrast: the contrast of a part
_SHRUNK_PX = 400  # size of the picture on which the noise is measured


class Polarity(StrEnum):
    """Whether the animal is darker or lighter than its ground."""

    DARK = "dark"
    LIGHT = "light"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class Silhouette:
    """One body, cut out of one image."""

    level: Singles
    """(h, w) contrast against the background, grey values; other things in the cut-out are 0."""
    threshold: float
    """Contrast at the boundary: half of the body's own."""
    noise_level: float
    """Contrast that noise alone may reach."""
    origin_px: tuple[float, float]
    """Position x, y of the cut-out's first pixel in the image."""
    area_px: float
    distractors: float
    """Area of the next largest visible object over this body's; noise and dirt count."""
    status: FrameStatus

    @property
    def mask(self) -> Bools:
        """(h, w) pixels of the body."""
        return self.level > self.threshold

    def window(self, margin_px: int = 0) -> tuple[slice, slice]:
        """Rows and columns of the cut-out in its image, with a margin within the image."""
        left, top = (int(v) for v in self.origin_px)
        rows, columns = self.level.shape
        return (
            slice(max(0, top - margin_px), top + rows + margin_px),
            slice(max(0, left - margin_px), left + columns + margin_px),
        )

    def window_within(self, outer: tuple[slice, slice]) -> tuple[slice, slice]:
        """Rows and columns of the cut-out within a window with a margin."""
        rows, columns = (
            slice(side.start - first.start, side.stop - first.start)
            for side, first in zip(self.window(), outer, strict=True)
        )
        return rows, columns


def edge_width_px(level: Singles, threshold: float) -> float:
    """Standard deviation of a blurred step as steep as a body's boundary, with all filters.

    Args:
        level: (h, w) contrast of one body.
        threshold: contrast at the boundary, half of the body's own.

    """
    mask = (level > threshold).astype(np.uint8)
    edge = (mask - cv2.erode(mask, np.ones((3, 3), np.uint8))) > 0
    across = cv2.Sobel(level, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(level, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    steep = float(np.median(np.hypot(across, down)[edge]))
    return float(2.0 * threshold / (np.sqrt(2.0 * np.pi) * max(steep, 1e-6)))


def as_deep_as(image: DeepImage, values: NDArray[Any]) -> DeepImage:
    """Convert to the image's depth; round for 8 bit."""
    if image.dtype == np.uint8 and values.dtype != np.uint8:
        return np.asarray(np.rint(values), dtype=np.uint8)
    return np.asarray(values, dtype=image.dtype)


def contrast(image: DeepImage, background: DeepImage, polarity: Polarity) -> DeepImage:
    """(H, W) contrast of each pixel; the strongest channel of a colour image."""
    if polarity is Polarity.BOTH:
        contrast_image = cv2.absdiff(image, background)
    elif polarity is Polarity.DARK:
        contrast_image = cv2.subtract(background, image)
    else:
        contrast_image = cv2.subtract(image, background)
    if contrast_image.ndim == 3:
        blue, two, three = (cv2.extractChannel(contrast_image, k) for k in range(3))
        contrast_image = cv2.max(cv2.max(blue, two, dst=blue), three, dst=blue)
    return np.asarray(
        np.maximum(contrast_image, 0) if contrast_image.dtype == np.float32 else contrast_image
    )


def soft_contrast(image: DeepImage, background: DeepImage, polarity: Polarity) -> DeepImage:
    """``contrast`` (H, W) with single-pixel noise averaged."""
    return as_deep_as(image, cv2.GaussianBlur(contrast(image, background, polarity), (3, 3), 0.0))


def noise_of(contrast_image: DeepImage) -> tuple[float, float]:
    """Median and spread of the background's contrast, from every n-th pixel."""
    every = max(1, min(contrast_image.shape) // _SHRUNK_PX + 1)
    some = contrast_image[::every, ::every].ravel()
    middle = float(np.median(some))
    above = some[some >= middle].astype(float) - middle
    return middle, float(1.4826 * np.median(above)) + 0.5


def silhouette_of(
    image: DeepImage,
    background: DeepImage,
    polarity: Polarity = Polarity.BOTH,
    threshold: float | None = None,
    *,
    wide_margin: bool = False,
) -> Silhouette:
    """Return the silhouette of the animal in one frame.

    Args:
        image: (H, W) or (H, W, 3), see ``DeepImage``.
        background: the same without the animal.
        polarity: whether the animal is darker or lighter than its ground.
        threshold: contrast at the boundary, grey levels; None: half of the body's own.
        wide_margin: whether the cut-out grows if the body fades out at its edge.

    """
    margin = _WIDE_MARGIN if wide_margin else _MARGIN
    contrast_image = soft_contrast(image, background, polarity)
    middle, spread = noise_of(contrast_image)
    clear = middle + _CLEAR * spread
    if threshold is not None:
        return cut_out(contrast_image, threshold, min(clear, threshold), middle, margin)
    threshold = body_threshold(contrast_image, middle, spread)
    if threshold is None:
        return _no_silhouette()
    return cut_out(contrast_image, threshold, clear, middle, margin)


def body_threshold(contrast_image: DeepImage, middle: float, spread: float) -> float | None:
    """Half of the strongest body's contrast, from a contrast (H, W) and its ``noise_of``.

    None: no body.
    """
    parts = connected_parts((contrast_image > middle + _CLEAR * spread).astype(np.uint8))
    if parts is None:
        return None
    return _threshold_of_body(contrast_image, *parts, middle, middle + 3.0 * spread)


def _threshold_of_body(
    contrast_image: DeepImage,
    label: Int32s,
    stats: Int32s,
    middle: float,
    least: float,
) -> float:
    """Half of the contrast of the part with the largest summed contrast.

    JPEG artefacts and soft shades may be larger than the animal and joined to it. If most of a part
    is fainter than half of its strong pixels, its contrast is a percentile weighted by squared
    contrast. The sum counts pixels above half of the part's contrast.
    """
    inside = np.flatnonzero(label > 0)
    strength = contrast_image.ravel()[inside].astype(np.float32) - middle
    squares = np.bincount(label.ravel()[inside], weights=strength**2, minlength=len(stats))
    best = least
    most = -1.0
    for part in np.argsort(squares)[: -_CANDIDATES - 1 : -1]:
        if squares[part] <= 0.0:
            break
        left, top, wide, high, _ = (int(v) for v in stats[part])
        window = (slice(top, top + high), slice(left, left + wide))
        body_strength = np.sort(contrast_image[window][label[window] == part]) - np.float32(middle)
        weight = np.cumsum(body_strength**2)
        level = float(body_strength[np.searchsorted(weight, _SHARE * weight[-1])])
        usual = float(np.percentile(body_strength, 70))
        if usual > 0.5 * level:
            level = usual
        threshold = max(middle + 0.5 * level, least)
        mass = float(body_strength[body_strength > threshold - middle].sum())
        if mass > most:
            best = threshold
            most = mass
    return best


def _no_silhouette() -> Silhouette:
    empty = np.zeros((1, 1), dtype=np.float32)
    return Silhouette(empty, 0.5, 0.0, (0.0, 0.0), 0.0, 0.0, FrameStatus.NOTHING)


def connected_parts(mask: DeepImage) -> tuple[Int32s, Int32s] | None:
    """Labels and statistics of the connected parts; None if all are tiny."""
    left, top, wide, high = cv2.boundingRect(mask)
    if wide * high < _LEAST_AREA_PX:
        return None
    window = (slice(top, top + high), slice(left, left + wide))
    kind = cv2.CV_16U if cv2.countNonZero(mask) < _MOST_LABELS else cv2.CV_32S
    count, inner, stats, _ = cv2.connectedComponentsWithStats(
        mask[window], connectivity=8, ltype=kind
    )
    if count < 2 or stats[1:, cv2.CC_STAT_AREA].max() < _LEAST_AREA_PX:
        return None
    label = np.zeros(mask.shape, dtype=np.int32)
    label[window] = inner
    stats[:, cv2.CC_STAT_LEFT] += left
    stats[:, cv2.CC_STAT_TOP] += top
    return label, np.asarray(stats, dtype=np.int32)


def cut_out(
    contrast_image: DeepImage, threshold: float, noise_level: float, middle: float, most_px: int
) -> Silhouette:
    """Cut out the body of most contrast above the threshold; its status is whether alone and whole.

    The margin is ``most_px`` if more than noise reaches the edge, else a few pixels.
    """
    above = contrast_image > threshold
    parts = connected_parts(above.astype(np.uint8))
    if parts is None:
        return _no_silhouette()
    label, stats = parts
    areas = stats[1:, cv2.CC_STAT_AREA]
    sums = np.bincount(label[above], weights=contrast_image[above] - np.float32(middle))
    best = 1 + int(np.argmax(sums[1:]))
    left, top, wide, high, area = (int(v) for v in stats[best])
    rows, columns = contrast_image.shape
    status = FrameStatus.GOOD
    distractors = float(np.delete(areas, best - 1).max(initial=0)) / area
    if distractors > _RIVAL:
        status = FrameStatus.SEVERAL
    elif left == 0 or top == 0 or left + wide == columns or top + high == rows:
        status = FrameStatus.CUT
    for margin in sorted({_MARGIN, most_px}):
        window = (
            slice(max(0, top - margin), min(rows, top + high + margin)),
            slice(max(0, left - margin), min(columns, left + wide + margin)),
        )
        level = contrast_image[window].astype(np.float32)
        rim = (level[0], level[-1], level[:, 0], level[:, -1])
        if not any(bool((side > noise_level).any()) for side in rim):
            break
    other = (label[window] != best) & (label[window] != 0)
    if other.any():
        level[cv2.dilate(other.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0] = 0.0
    origin = (float(window[1].start), float(window[0].start))
    return Silhouette(level, threshold, noise_level, origin, float(area), distractors, status)
