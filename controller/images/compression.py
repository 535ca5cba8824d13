"""Frames that JPEG or MJPEG has compressed: recognised, graded and smoothed.

A decoded frame still contains its quantisation: the cosine coefficients of its blocks of 8 px are
multiples of the steps of its quality. Its blocks disappear if it is compressed again on shifted
grids and averaged (A. Nosratinia, "Enhancement of JPEG-compressed images by re-application of
JPEG", Journal of VLSI Signal Processing 27, 2001).
"""

from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image

_BLOCK_PX = 8  # of JPEG and of MJPEG
_BLOCKS = 1.3  # steps between blocks over those within: more is compression (ours)
_STEP = 4  # grey levels: a larger step is an edge of the scene (ours)
_BLOCK_EXCESS = 3.0  # times the single steps at other columns: more is compression (ours)
_LUMA = np.array([
    [16, 11, 10, 16, 24, 40, 51, 61], [12, 12, 14, 19, 26, 58, 60, 55],
    [14, 13, 16, 24, 40, 57, 69, 56], [14, 17, 22, 29, 51, 87, 80, 62],
    [18, 22, 37, 56, 68, 109, 103, 77], [24, 35, 55, 64, 81, 104, 113, 92],
    [49, 64, 78, 87, 103, 121, 120, 101], [72, 92, 95, 98, 112, 100, 103, 99],
])  # fmt: skip
"""Steps at quality 50: ITU-T T.81, table K.1; scaled as in libjpeg."""
_QUALITIES = range(3, 61)
_MOST_BLOCKS = 800  # that are looked at for the quality
_FEWEST = 30  # coefficients that show a quality
_NOT_ZERO = 0.7  # of a step: a larger coefficient is not stored as 0
_REGULAR = 0.8  # mean cosine of the coefficients over the steps: they are multiples (ours)
_SHIFTS = tuple((k, (7 * k + off) % 16) for k in range(16) for off in (0, 8))
"""Offsets x, y of the shifted grids: even over the 16 px of a block of colour."""
_CLEAN = 16.0  # quality below which poses are less accurate than the sections show (ours)
_LEAST_QUALITY = 18  # quality below which no pose is used (ours)
_USUAL_QUALITY = 20  # quality from which most poses are used (ours)
_SIGMA = 0.22
_SIGMA_BELOW = 0.15  # radii: largest standard deviation from it on, below it (ours)
_SIGMA_UNKNOWN = 0.25  # radii: the same if the quality is not known (ours)


@dataclass(frozen=True, slots=True)
class Compression:
    """How strongly a frame is compressed."""

    quality: int | None
    """JPEG quality, 3 to 60; None if the blocks do not show it."""

    @property
    def widening(self) -> float:
        """Factor of the uncertainty of a pose."""
        return 1.0 if self.quality is None else max(1.0, _CLEAN / self.quality)

    @property
    def sigma_limit(self) -> float:
        """Largest standard deviation of a pose that is used, in radii of the body; 0: none is."""
        if self.quality is None:
            return _SIGMA_UNKNOWN
        if self.quality < _LEAST_QUALITY:
            return 0.0
        return _SIGMA if self.quality >= _USUAL_QUALITY else _SIGMA_BELOW

    def __str__(self) -> str:
        """State the compression and the remedy."""
        how = "" if self.quality is None else f" (JPEG quality about {self.quality})"
        return f"the frame is strongly compressed{how}; set the camera's JPEG quality to 30 or more"

    @property
    def explains_faults(self) -> bool:
        """Whether the compression alone is strong enough to reject a pose."""
        return self.quality is None or self.quality < _USUAL_QUALITY


def compression_of(image: Image) -> Compression | None:
    """Return the compression of a frame (H, W[, 3]); None if its blocks are not seen."""
    return Compression(_quality(image)) if _has_blocks(image) else None


def without_blocks(image: Image, compression: Compression) -> Image:
    """Return a compressed frame, or a part of it, with smooth blocks; itself if it cannot."""
    if compression.quality is None:
        return image
    high, wide = image.shape[:2]
    framed = cv2.copyMakeBorder(image, 16, 0, 16, 0, cv2.BORDER_REPLICATE)
    total = np.zeros(image.shape, dtype=np.float32)
    how = [cv2.IMWRITE_JPEG_QUALITY, compression.quality]
    for x, y in _SHIFTS:
        coded = cv2.imencode(".jpg", np.ascontiguousarray(framed[y:, x:]), how)[1]
        again = np.asarray(cv2.imdecode(coded, cv2.IMREAD_UNCHANGED))
        total += again[16 - y : 16 - y + high, 16 - x : 16 - x + wide]
    return np.rint(total / len(_SHIFTS)).astype(np.uint8)


def _has_blocks(image: Image) -> bool:
    """Whether every eighth column of a frame has the largest steps, or the only ones.

    Strong compression leaves most blocks without any step, except to the next block.
    """
    grey = _grey(image[::3]).astype(np.int16)
    steps = np.minimum(np.abs(np.diff(grey, axis=1)), _STEP)
    steps = steps[:, : steps.shape[1] // _BLOCK_PX * _BLOCK_PX]
    mean = np.median(steps.mean(axis=0).reshape(-1, _BLOCK_PX), axis=0)  # scenes have few edges
    if np.median(mean) > 0.0:
        return bool(mean[-1] > _BLOCKS * np.median(mean[:-1]))
    moved = (steps > 0).astype(np.float32)
    block_edges = cv2.boxFilter(moved, -1, (_BLOCK_PX - 1, 1), normalize=False)
    alone = ((moved > 0) & (block_edges < 1.5)).sum(axis=0).reshape(-1, _BLOCK_PX).sum(axis=0)
    return bool(alone[-1] > _BLOCK_EXCESS * max(np.median(alone[:-1]), 1.0))


def _quality(image: Image) -> int | None:
    """Quality whose steps best divide the coefficients of a frame; None if none does."""
    value = _coefficients(_grey(image).astype(np.float32))
    value = value[np.abs(value).max(axis=1) > _NOT_ZERO]
    value = value[:: max(1, len(value) // _MOST_BLOCKS)]
    best = _REGULAR
    best_quality = None
    for quality in _QUALITIES:
        scale = 5000 // quality if quality < 50 else 200 - 2 * quality
        step = np.clip((_LUMA * scale + 50) // 100, 1, 255).ravel()[1:].astype(np.float32)
        share = value / step
        some = share[np.abs(share) > _NOT_ZERO]
        if some.size < _FEWEST:
            continue
        regular = float(np.cos(2.0 * np.pi * some).mean())
        if regular > best:
            best = regular
            best_quality = quality
    return best_quality


def _grey(image: Image) -> Image:
    """(H, W) luminance of a picture (H, W[, 3])."""
    return np.asarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))


def _coefficients(grey: Floats) -> Floats:
    """(blocks, 63) cosine coefficients of the blocks of 8 px, without their mean."""
    k, n = np.mgrid[:_BLOCK_PX, :_BLOCK_PX]
    cosine = np.sqrt(np.where(k == 0, 1.0, 2.0) / _BLOCK_PX) * np.cos(
        (2 * n + 1) * k * np.pi / (2 * _BLOCK_PX)
    )
    cosine = cosine.astype(np.float32)
    high, wide = (side // _BLOCK_PX for side in grey.shape)
    blocks = grey[: high * _BLOCK_PX, : wide * _BLOCK_PX].reshape(high, _BLOCK_PX, wide, _BLOCK_PX)
    value = cosine @ blocks.transpose(0, 2, 1, 3) @ cosine.T
    return np.asarray(value.reshape(-1, _BLOCK_PX**2)[:, 1:])
