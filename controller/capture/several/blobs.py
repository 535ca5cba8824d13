"""Blobs of one frame: connected parts that may be one or several animals."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, DeepImage, Floats, Int32s, Ints
from snakewalk.controller.images.background import background_candidates, median_background
from snakewalk.controller.images.body_detector import BodyDetector, usual_polarity
from snakewalk.controller.images.silhouette import (
    body_threshold,
    connected_parts,
    noise_of,
    soft_contrast,
)

SMALLEST = 0.3
"""Area of a blob over the usual area of an animal; smaller ones are dirt."""
_LEAST_AREA = 0.97  # of the largest area of all animals: with it a background shows all of them
_SURFACE = "a smooth surface through each frame"
_PIECE = 0.08  # of the usual area: a piece of an animal, not noise
_SINGLE_AREA = 1.5  # of the usual area: a region is one animal
_BROKEN = 0.1  # of the frames with an animal in pieces: the background contains its middle
_LARGER = 1.05  # times the usual area: the surface shows more, and pieces are not chance contacts
FEATURES = ("length", "width", "contrast")
"""Columns of ``Blobs.shape``."""


@dataclass(frozen=True, slots=True)
class Blobs:
    """The n blobs of a frame."""

    label: Int32s
    """(H, W) 1 to n in the blobs, 0 elsewhere."""
    boxes: Ints
    """(n, 4) left, top, width, height, px."""
    area_px: Floats
    """(n,) areas of the blobs, px."""
    middle_px: Floats
    """(n, 2) x, y of the centroid."""
    shape: Floats
    """(n, 3) logarithms of ``FEATURES``: px, px, grey levels."""


def blobs_of(
    frame: DeepImage,
    detector: BodyDetector,
    usual_px: float = 0.0,
    ground: DeepImage | None = None,
) -> Blobs:
    """Return the blobs of a frame.

    Args:
        frame: (H, W[, C]).
        detector: its polarity, threshold and region are used.
        usual_px: usual area of an animal; 0: any size.
        ground: the frame without animals; None: that of the detector.

    """
    if ground is None:
        ground = detector.ground_of(frame)
    contrast_image = soft_contrast(frame, ground, detector.polarity)
    if detector.inside is not None:
        contrast_image = np.where(detector.inside, contrast_image, np.zeros_like(contrast_image))
    threshold = detector.threshold
    if threshold is None:
        threshold = body_threshold(contrast_image, *noise_of(contrast_image))
    parts = None
    if threshold is not None:
        parts = connected_parts((contrast_image > threshold).astype(np.uint8))
    label, stats = parts or (
        np.zeros(contrast_image.shape, dtype=np.int32),
        np.zeros((1, cv2.CC_STAT_MAX), dtype=np.int32),
    )
    area = stats[:, cv2.CC_STAT_AREA].astype(float)
    kept = 1 + np.flatnonzero(area[1:] >= max(1.0, SMALLEST * usual_px))
    number = np.zeros(len(stats), dtype=np.int32)
    number[kept] = np.arange(1, len(kept) + 1)
    boxes = stats[kept, :4].astype(int)
    label = number[label]
    measured = [
        _measured_blob(label, contrast_image, k, box) for k, box in enumerate(boxes, start=1)
    ]
    middle = np.array([middle_px for middle_px, _ in measured]).reshape(-1, 2)
    shape = np.array([features for _, features in measured]).reshape(-1, len(FEATURES))
    return Blobs(label, boxes, area[kept], middle, shape)


def _measured_blob(
    label: Int32s, contrast_image: DeepImage, number: int, box: Ints
) -> tuple[Floats, Floats]:
    """Centroid of a blob, and its shape: the rectangle of equal area and perimeter."""
    left, top, wide, high = (int(v) for v in box)
    window = (slice(top, top + high), slice(left, left + wide))
    mask = (label[window] == number).astype(np.uint8)
    rows, columns = np.nonzero(mask)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    around = max(cv2.arcLength(outline, True) for outline in outlines)
    area = float(len(rows))
    length = 0.25 * (around + np.sqrt(max(0.0, around**2 - 16.0 * area)))
    length = max(length, 1.0)
    contrast = float(contrast_image[window][mask > 0].mean())
    middle = np.array([left + columns.mean(), top + rows.mean()])
    return middle, np.log([length, max(area / length, 0.5), max(contrast, 0.5)])


def usual_area(frames: Sequence[Blobs]) -> float:
    """Usual area of an animal: larger blobs make up half of the total; 0: nothing stands out."""
    area = np.sort(np.concatenate([blobs.area_px for blobs in frames]))
    if not area.size:
        return 0.0
    share = np.cumsum(area) / area.sum()
    return float(area[np.searchsorted(share, 0.5)])


def count_of(frames: Sequence[Blobs]) -> tuple[int, float]:
    """Median number of animals in some frames, and their mean total area."""
    least = SMALLEST * usual_area(frames)
    large = [blobs.area_px[blobs.area_px >= least] for blobs in frames]
    return int(np.median([len(areas_px) for areas_px in large])), float(
        np.mean([areas_px.sum() for areas_px in large])
    )


def detector_of_several(
    frames: Sequence[DeepImage],
    background: DeepImage | None = None,
    *,
    inside: Bools | None = None,
    threshold: float | None = None,
    requested_count: int | None = None,
) -> BodyDetector:
    """Learn the scene of several animals from a few frames of a fixed camera.

    The median over frames shows animals where they rest or come back. A lighter or darker quantile
    of each pixel is used if animals are larger against it, or nearer to ``requested_count``. All of
    them contain animals that hardly move. A surface fitted to each frame is used if it shows
    animals in one piece that are in several pieces otherwise.

    Args:
        frames: (H, W[, C]), spread over the film.
        background: the scene without animals.
        inside: (H, W) where animals may be.
        threshold: contrast at the boundary of a body, grey levels.
        requested_count: number of animals; None: unknown.

    """
    if background is not None:
        polarity = usual_polarity(frames, background)
        return BodyDetector(background, polarity, "given", 0, inside, threshold)
    tried: list[tuple[int, float, BodyDetector, list[Blobs]]] = []
    polarity = usual_polarity(frames, median_background(frames))
    for ground, supposed, source in background_candidates(frames):
        if supposed is not None and supposed is not polarity:
            continue
        detector = BodyDetector(ground, polarity, source, 0, inside, threshold)
        blobs = [blobs_of(frame, detector) for frame in frames]
        count, area = count_of(blobs)
        if count:
            excess = 0 if requested_count is None else abs(count - requested_count)
            tried.append((excess, area, detector, blobs))
    surface = BodyDetector(None, polarity, _SURFACE, 0, inside, threshold)
    if not tried:
        return surface
    nearest = min(trial[0] for trial in tried)
    tried = [trial for trial in tried if trial[0] == nearest]
    largest = max(trial[1] for trial in tried)
    _, _, fixed, parts = next(trial for trial in tried if trial[1] >= _LEAST_AREA * largest)
    regions = [blobs_of(frame, surface) for frame in frames]
    return surface if _breaks_animals(regions, parts) else fixed


def _breaks_animals(regions: Sequence[Blobs], parts: Sequence[Blobs]) -> bool:
    """Whether a fixed background hides the middles of animals that a surface shows."""
    usual = usual_area(regions)
    broken = 0
    for blobs, pieces in zip(regions, parts, strict=True):
        common = (blobs.label > 0) & (pieces.label > 0)
        pairs = np.stack([blobs.label[common], pieces.label[common]])
        region, piece = np.unique(pairs, axis=1) - 1
        is_piece = (pieces.area_px[piece] > _PIECE * usual) & (
            blobs.area_px[region] < _SINGLE_AREA * usual
        )
        broken += int((np.bincount(region[is_piece]) > 1).any())
    return broken > _BROKEN * len(regions) and usual > _LARGER * usual_area(parts)


def own_window(blobs: Blobs, number: int, around_px: int) -> tuple[slice, slice]:
    """Rows and columns of blob ``number`` (from 0) with a margin."""
    rows, columns = blobs.label.shape
    left, top, wide, high = (int(v) for v in blobs.boxes[number])
    return (
        slice(max(0, top - around_px), min(rows, top + high + around_px)),
        slice(max(0, left - around_px), min(columns, left + wide + around_px)),
    )


def mask_of_other_animals(
    blobs: Blobs, number: int, window: tuple[slice, slice], reach_px: int
) -> Bools:
    """(h, w) pixels of a window that show other animals, with their blurred edges."""
    label = blobs.label[window]
    is_blob = label == number + 1
    other = ((label > 0) & ~is_blob).astype(np.uint8)
    if not other.any():
        return np.zeros(label.shape, dtype=bool)
    box = np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8)
    near_own = cv2.dilate(is_blob.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return (cv2.dilate(other, box) > 0) & ~near_own
