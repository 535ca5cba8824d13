"""Parts of a body that are much fainter than the rest: a pale tail, light bands."""

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage
from snakewalk.controller.images.silhouette import (
    Polarity,
    Silhouette,
    connected_parts,
    cut_out,
    noise_of,
    soft_contrast,
)
from snakewalk.controller.track.frame_status import FrameStatus

_AWAY_WIDTHS = 1.2  # widths from the silhouette: blur and shadow stay nearer
_NOTABLE_AREA = 0.06  # of the silhouette's area: fewer faint pixels are not a part of the body
FAINTEST = 0.07
"""Least contrast of a part, relative to that of the body: fainter areas are stains or trails."""
_MARGIN_PX = 20  # of the cut-out, where the body fades out
_BLUR_PX = 4  # around the silhouette: a larger area is not its blur
_TYPICAL = 40.0  # percentile of the contrast along the middle of the faint parts


def may_have_faint_parts(body: Silhouette) -> bool:
    """Whether a fainter area extends beyond the silhouette's box, or another body is similar."""
    if body.status is FrameStatus.SEVERAL:
        return True
    if body.status is not FrameStatus.GOOD:
        return False
    level_box = np.array(cv2.boundingRect((body.level > body.noise_level).astype(np.uint8)))
    core = np.array(cv2.boundingRect(body.mask.astype(np.uint8)))
    before, after = (
        core[:2] - level_box[:2],
        (level_box[:2] + level_box[2:]) - (core[:2] + core[2:]),
    )
    return bool(max(before.max(), after.max()) > _BLUR_PX)


def with_faint_parts(
    image: DeepImage, background: DeepImage, polarity: Polarity, body: Silhouette
) -> Silhouette | None:
    """Return the silhouette with all connected pixels above the noise; None if nothing is added.

    The contrast is clipped at that of the faint part, so that the boundary lies at half of it
    everywhere.

    Args:
        image: (H, W[, 3]) the frame.
        background: the same without the animal.
        polarity: whether the animal is darker or lighter than its ground.
        body: the part of most contrast.

    """
    contrast_image = soft_contrast(image, background, polarity)
    parts = connected_parts((contrast_image > body.noise_level).astype(np.uint8))
    if parts is None:
        return None
    label, stats = parts
    inner = label[body.window()]
    core_part = int(np.bincount(inner[body.mask & (inner > 0)], minlength=2).argmax())
    x, y, wide, high, _ = (int(v) for v in stats[core_part])
    core_box = cv2.boundingRect(body.mask.astype(np.uint8))
    if core_part == 0 or max(wide, high) <= max(core_box[2:]) + _BLUR_PX:
        return None
    window = (slice(y, y + high), slice(x, x + wide))
    joined = label[window] == core_part
    core = np.zeros(label.shape, dtype=np.uint8)
    core[body.window()] = body.mask
    thick = 2.0 * float(cv2.distanceTransform(core, cv2.DIST_L2, 5).max())
    away = np.asarray(cv2.distanceTransform(1 - core[window], cv2.DIST_L2, 5))
    beyond = joined & (away > _AWAY_WIDTHS * thick)
    if np.count_nonzero(beyond) < _NOTABLE_AREA * body.area_px:
        return None
    middle, _ = noise_of(contrast_image)
    depth = np.asarray(cv2.distanceTransform(np.pad(joined, 1).astype(np.uint8), cv2.DIST_L2, 5))
    ridge = (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8)))[1:-1, 1:-1] & beyond
    if not ridge.any():
        return None
    faint = float(np.percentile(contrast_image[window][ridge], _TYPICAL)) - middle
    threshold = max(middle + 0.5 * faint, body.noise_level)
    if faint < FAINTEST * 2.0 * (body.threshold - middle) or threshold > 0.9 * body.threshold:
        return None
    flat = np.minimum(contrast_image, 2.0 * threshold).astype(np.float32)
    return cut_out(flat, threshold, body.noise_level, middle, _MARGIN_PX)
