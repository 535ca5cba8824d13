"""The ground without the animal: from many frames, or from one frame."""

from collections.abc import Iterator, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import DeepImage
from snakewalk.controller.images.silhouette import Polarity, as_deep_as

_GRID_PX = 64  # longest side of the image to which the surface is fitted
_ROUNDS = 4
_STRONGEST_PX = 20.0  # number of pixels that decide the polarity
_SHRUNK_PX = 400  # side of the picture of which medians are taken
_CLEAR = 6.0  # standard deviations of the noise: a contrast that shows an animal
_QUANTILE = 0.85  # a slow dark animal may cover a pixel in up to this share of the frames


def median_background(frames: Sequence[DeepImage]) -> DeepImage:
    """Median (H, W[, 3]) over frames of one size; each pixel must be uncovered in half of them."""
    return _quantiles(frames, 0.5)[0]


def background_candidates(
    frames: Sequence[DeepImage],
) -> Iterator[tuple[DeepImage, Polarity | None, str]]:
    """Yield the median over frames, then a light and a dark quantile for slow animals.

    Yields:
        Background (H, W[, 3]), the polarity that it assumes (None: any), and its name.

    """
    median, lighter, darker = _quantiles(frames, 0.5, _QUANTILE, 1.0 - _QUANTILE)
    yield median, None, "the median of frames"
    yield lighter, Polarity.DARK, "the lighter half of the frames at each place"
    yield darker, Polarity.LIGHT, "the darker half of the frames at each place"


def _quantiles(frames: Sequence[DeepImage], *quantiles: float) -> list[DeepImage]:
    """Quantiles of each pixel, by exchanges of neighbours until all frames are in order."""
    rows = list(frames)
    for number in range(len(rows)):
        for k in range(number % 2, len(rows) - 1, 2):
            pair = rows[k], rows[k + 1]
            rows[k], rows[k + 1] = np.minimum(*pair), np.maximum(*pair)
    return [rows[round(quantile * (len(rows) - 1))] for quantile in quantiles]


def smooth_background(image: DeepImage) -> DeepImage:
    """Background from the frame itself: a second-order surface fitted without the animal.

    For an animal that hardly moves, or cropped images. The ground must be plain; its light may be
    uneven.
    """
    if image.ndim == 3:
        return np.dstack([smooth_background(image[..., k]) for k in range(image.shape[2])])
    rows, columns = image.shape
    shrink = max(1.0, max(rows, columns) / _GRID_PX)
    size = (max(4, round(columns / shrink)), max(4, round(rows / shrink)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = np.asarray(small, dtype=float).ravel()
    y, x = np.meshgrid(*(np.linspace(-1.0, 1.0, side) for side in small.shape), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
    rest = grey - np.median(grey)
    for _ in range(_ROUNDS):
        spread = 1.4826 * float(np.median(np.abs(rest - np.median(rest)))) + 1.0
        kept = np.abs(rest - np.median(rest)) < 2.5 * spread
        some = terms[kept]
        fit = np.linalg.solve(some.T @ some + 1e-6 * np.eye(6), some.T @ grey[kept])
        rest = grey - terms @ fit
    surface = (terms @ fit).reshape(small.shape).astype(np.float32)
    if image.dtype == np.uint8:
        surface = np.clip(surface, 0.0, 255.0)
    smooth_image = cv2.resize(surface, (columns, rows), interpolation=cv2.INTER_LINEAR)
    return as_deep_as(image, smooth_image)


def surrounding_ground(image: DeepImage, polarity: Polarity, side_px: int) -> DeepImage:
    """Background (H, W[, 3]) without objects narrower than ``side_px``, by morphological closing.

    Light objects need an opening. Wide shades of the ground remain (vignettes, stains, lamps).
    """
    kind = cv2.MORPH_OPEN if polarity is Polarity.LIGHT else cv2.MORPH_CLOSE
    calm = cv2.medianBlur(image, 3)
    box = np.ones((side_px, side_px), dtype=np.uint8)
    closed = cv2.morphologyEx(calm, kind, box, borderType=cv2.BORDER_REPLICATE)
    return as_deep_as(image, cv2.blur(closed, (side_px, side_px)))


def contrast_polarity(image: DeepImage, background: DeepImage) -> Polarity | None:
    """Whether the pixels of most contrast are darker or lighter than the ground, or both.

    None: nothing stands out by more than noise.
    """
    kind: type[np.int16 | np.float32] = np.int16 if image.dtype == np.uint8 else np.float32
    contrast_image: NDArray[Any] = image.astype(kind) - background.astype(kind)
    if contrast_image.ndim == 3:
        strongest_channel, *others = (
            np.asarray(cv2.extractChannel(contrast_image, k))
            for k in range(contrast_image.shape[2])
        )
        for other in others:
            stronger = np.abs(other) > np.abs(strongest_channel)
            np.copyto(strongest_channel, other, where=stronger)
        contrast_image = strongest_channel
    every = max(1, min(contrast_image.shape) // _SHRUNK_PX)
    smooth = cv2.GaussianBlur(contrast_image.astype(np.float32), (5, 5), 0.0)
    smooth = smooth - np.float32(np.median(contrast_image[::every, ::every]))
    size = np.abs(smooth)
    few = min(smooth.size // 2, round(_STRONGEST_PX))
    strongest = float(np.partition(size.ravel(), -few)[-few])
    if strongest < _CLEAR * 1.4826 * float(np.median(size[::every, ::every])):
        return None
    edge = 0.5 * strongest
    dark = np.count_nonzero(smooth < -edge)
    light = np.count_nonzero(smooth > edge)
    if max(dark, light) < 4 * min(dark, light):
        return Polarity.BOTH
    return Polarity.DARK if dark > light else Polarity.LIGHT
