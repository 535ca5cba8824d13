"""Parts of a frame that a body does not explain: a part beyond its tips, or a ghost."""

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, DeepImage, Floats
from snakewalk.controller.images.background import surrounding_ground
from snakewalk.controller.images.cross_profile import values_at
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.images.silhouette import (
    Polarity,
    Silhouette,
    edge_width_px,
    soft_contrast,
)
from snakewalk.controller.track.frame_status import FrameStatus

_MARGIN_LENGTHS = 0.5  # of the length: margin on each side
_WEAK_LEVEL = 0.2  # share of the body's contrast: a weaker residual is ground
_NEAR_WIDTHS = 1.5  # widths from a tip: a nearer residual may belong to the body
_AWAY_WIDTHS = 1.2  # widths from the body: a shadow stays nearer
_PART = 0.02  # of the body's summed contrast: a larger residual beyond a tip is a part of it
_OTHER_PART_WIDTHS = 4.0  # widths along the body from which a part next to a tip is another one
_GAP_WIDTHS = 2.0  # widths from a tip: a farther part is not next to it
_GAP_SAMPLES = 101
_GAP_BLURS = 3.4  # widths of a blurred edge: an empty gap that holds as much is narrower (measured)
_GHOST = 0.05  # the same for objects that only the background shows
_GHOST_WEAK = 0.3  # of the body's contrast
_EDGES = 0.5  # share of the outline's edges that the frame must show; a ghost has about none


def check_residual(
    image: DeepImage,
    background: DeepImage,
    polarity: Polarity,
    silhouette: Silhouette,
    skeleton: Skeleton,
    *,
    ghosts: bool,
) -> FrameStatus:
    """Return ``GOOD`` if the body explains the picture around it, else ``PART`` or ``GHOST``.

    Args:
        image: (H, W[, 3]) the frame.
        background: the same without the animal.
        polarity: whether the animal is darker or lighter than its ground.
        silhouette: the body in the frame.
        skeleton: its skeleton.
        ghosts: whether the background comes from the film and may show the animal itself.

    """
    wide = 2.0 * max(np.median(skeleton.radius_px), 0.5)
    around = round(_MARGIN_LENGTHS * skeleton.length_px)
    window = silhouette.window(around)
    window_image = image[window]
    ground = background[window]
    body = np.zeros(window_image.shape[:2], dtype=bool)
    body[silhouette.window_within(window)] = silhouette.mask
    soft_level = soft_contrast(window_image, ground, polarity)
    level = 2.0 * silhouette.threshold
    mass = float(soft_level[body].sum())
    least = max(silhouette.noise_level, _WEAK_LEVEL * level)
    tips = skeleton.points_px[[0, -1]] - [window[1].start, window[0].start]
    apart = cv2.distanceTransform((~body).astype(np.uint8), cv2.DIST_L2, 5)
    away_px = np.asarray(apart, dtype=np.float32)
    if _beyond_tips(soft_level, away_px, tips, wide, least) > _PART * mass:
        return FrameStatus.PART
    if _continues_to_itself(silhouette, skeleton, wide, least):
        return FrameStatus.PART
    if ghosts and polarity is not Polarity.BOTH:
        least = max(silhouette.noise_level, _GHOST_WEAK * level)
        if _ghost(window_image, ground, polarity, away_px, wide, least) > _GHOST * mass:
            return FrameStatus.GHOST
    return FrameStatus.GOOD


def is_ghost(image: DeepImage, background: DeepImage, silhouette: Silhouette) -> bool:
    """Whether the outline of a silhouette is an edge of the background and not of the frame.

    Frame minus background has the gradient a - b along the outline. The share of the frame in its
    square, a (a - b), is 1 for a body on bare ground and 0 where only the background shows a body.
    """
    window = silhouette.window()
    body = silhouette.mask.astype(np.uint8)
    box = np.ones((3, 3), dtype=np.uint8)
    outline = cv2.dilate(body, box) != cv2.erode(body, box)
    gradient = _gradient(image[window], outline)
    difference = gradient - _gradient(background[window], outline)
    return float((gradient * difference).sum()) < _EDGES * float((difference * difference).sum())


def _gradient(image: DeepImage, places: Bools) -> Floats:
    """(2, P[, C]) slopes along x and y at some places (H, W), with single-pixel noise averaged."""
    grey = cv2.GaussianBlur(np.asarray(image, dtype=np.float32), (3, 3), 0.0)
    slopes = [cv2.Sobel(grey, cv2.CV_32F, *order)[places] for order in ((1, 0), (0, 1))]
    return np.asarray(slopes, dtype=float)


def _beyond_tips(
    soft_level: DeepImage, away_px: DeepImage, tips: Floats, wide: float, least: float
) -> float:
    """Summed contrast of residuals that start at a tip and lead away from the body."""
    rest = (soft_level > least) & (away_px > 1.5)
    count, label = cv2.connectedComponents(rest.astype(np.uint8), connectivity=8)
    y, x = np.nonzero(rest)
    part = label[rest]
    near = np.zeros(count, dtype=bool)
    for tip in tips:
        near[part[np.hypot(x - tip[0], y - tip[1]) < _NEAR_WIDTHS * wide + 2.0]] = True
    away = rest & (away_px > _AWAY_WIDTHS * wide)
    return float(soft_level[away & near[label]].sum())


def _continues_to_itself(
    silhouette: Silhouette, skeleton: Skeleton, wide: float, least: float
) -> bool:
    """Whether something faint lies in a gap between a tip and another part of the body."""
    line = skeleton.points_px - np.asarray(silhouette.origin_px)
    along = np.arange(len(line)) * skeleton.length_px / len(line)
    blur_px = edge_width_px(silhouette.level, silhouette.threshold)
    for tip in (0, -1):
        away = np.hypot(*(line - line[tip]).T)
        away[np.abs(along - along[tip]) < _OTHER_PART_WIDTHS * wide] = np.inf
        if away.min() > _GAP_WIDTHS * wide:
            continue
        gap = np.linspace(line[tip], line[np.argmin(away)], _GAP_SAMPLES)
        level = values_at(silhouette.level, gap)
        gap_px = float((level < silhouette.threshold).mean() * away.min())
        if gap_px > _GAP_BLURS * blur_px and level.min() > least:
            return True
    return False


def _ghost(
    window_image: DeepImage,
    ground: DeepImage,
    polarity: Polarity,
    away_px: DeepImage,
    wide: float,
    least: float,
) -> float:
    """Summed contrast of the wrong sign next to the body, if the ground shows a similar shape."""
    wrong = soft_contrast(ground, window_image, polarity)
    side = 2 * round(1.5 * wide) + 3
    ground_level = soft_contrast(ground, surrounding_ground(ground, polarity, side), polarity)
    shown = (wrong > least) & (ground_level > least) & (away_px > 1.5)
    count, label = cv2.connectedComponents(shown.astype(np.uint8), connectivity=8)
    near = np.zeros(count, dtype=bool)
    near[label[shown & (away_px < wide)]] = True
    return float(wrong[shown & near[label]].sum())
