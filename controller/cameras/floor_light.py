"""The light on a floor, and the differences that it does not explain.

The ratio of a frame to the empty floor is smooth or has edges (gain, a gradient, a patch of sun),
and the robot is thin. So the median of the ratio over a square of twice the body's area never shows
the body.
"""

import cv2
import numpy as np

from snakewalk.config.arrays import Image, Singles

_UNIT_LIGHT = 100.0  # of 255: a ratio of 1; the largest ratio is 2.5
_DARKEST = np.uint8(8)  # grey levels: a ratio to a darker level is meaningless
_GLARE = 0.3  # by which light may exceed that of the surroundings: soft edges (ours)
_COARSE = 4  # frame pixels per pixel of its wide light
_COLUMNS = 4  # column step for the light of a row
_ROWS = 4  # row distance for an edge of a band
_BANDS = 0.06  # change of the light at a band's edge (ours)


def lit_floor(image: Image, floor: Image, body_area_px: float) -> Image:
    """(H, W[, 3]) the empty floor in the light of a frame.

    ``floor`` is the same view without the robot, in another light; the robot covers
    ``body_area_px``.
    """
    light = _light(image, floor, int(np.sqrt(2.0 * body_area_px)) + 1)
    return np.asarray(cv2.multiply(floor, light, scale=1.0 / _UNIT_LIGHT), dtype=np.uint8)


def banded_floor(image: Image, floor: Image) -> Image:
    """(H, W[, 3]) the empty floor with the row bands of a flickering lamp in a frame.

    The rows must be complete: the median of each row is its light. Without steps the floor is
    returned.
    """
    ratio = grey_of(image[:, ::_COLUMNS]) / np.maximum(grey_of(floor[:, ::_COLUMNS]), _DARKEST)
    light = np.median(ratio, axis=1).astype(np.float32)
    step = np.abs(np.diff(np.log(np.maximum(light, 0.01)[::_ROWS])))
    if step.max(initial=0.0) < _BANDS:
        return floor
    rows = light.reshape(-1, *(1,) * (floor.ndim - 1))
    return np.asarray(np.clip(np.rint(floor * rows), 0.0, 255.0), dtype=np.uint8)


def in_light_of(image: Image, floor: Image) -> Singles:
    """(H, W[, 3]) a frame converted to the light of its floor's picture.

    Light is the common change of a square of a third of the picture's width, on a reduced picture.
    A change over less than half of it is not light.
    """
    size = image.shape[1], image.shape[0]
    small = max(size[0] // _COARSE, 1), max(size[1] // _COARSE, 1)
    now, then = (
        cv2.resize(level_picture, small, interpolation=cv2.INTER_AREA)
        for level_picture in (image, floor)
    )
    light = _light(np.asarray(now, np.uint8), np.asarray(then, np.uint8), small[0] // 3)
    full_light = cv2.resize(np.maximum(light, 1), size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(
        cv2.divide(image, full_light, scale=_UNIT_LIGHT, dtype=cv2.CV_32F), dtype=np.float32
    )


def _light(image: Image, floor: Image, side_px: int) -> Image:
    """(H, W[, 3]) factor of the floor's grey levels in a frame, in hundredths."""
    ratio = cv2.divide(grey_of(image), np.maximum(grey_of(floor), _DARKEST), scale=_UNIT_LIGHT)
    light = np.asarray(
        cv2.medianBlur(np.asarray(ratio, dtype=np.uint8), min(side_px | 1, 255)), dtype=np.uint8
    )
    return light if floor.ndim == 2 else np.dstack([light] * 3)


def unexplained(image: Image, lit: Image, shade: float) -> Singles:
    """(H, W) grey levels of a frame's difference from its lit floor, in the strongest channel.

    Shadow and light scale all channels equally. A pixel that is darker by up to ``shade`` or
    slightly brighter in all channels is floor; from others this part is subtracted.
    """
    now, floor = (np.atleast_3d(levels).astype(np.float32) for levels in (image, lit))
    ratio = now / np.maximum(floor, 1.0)
    channels = [ratio[..., k] for k in range(ratio.shape[2])]
    most, least = channels[0], channels[0]
    for channel in channels[1:]:
        most, least = np.maximum(most, channel), np.minimum(least, channel)
    shadow = np.clip(most, 1.0 - shade, 1.0)
    glare = np.clip(least, 1.0, 1.0 + _GLARE)
    excess = np.zeros(most.shape, dtype=np.float32)
    for k in range(ratio.shape[2]):
        level = now[..., k]
        ground = floor[..., k]
        np.maximum(excess, np.maximum(shadow * ground - level, level - glare * ground), out=excess)
    return excess


def grey_of(image: Image) -> Image:
    """(H, W) grey levels of a picture (H, W[, 3])."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.asarray(grey, dtype=np.uint8)
