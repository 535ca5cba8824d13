"""Error of a medial axis: blur moves the threshold's tips along the body."""

import numpy as np

from snakewalk.config.arrays import Singles
from snakewalk.controller.images.silhouette import edge_width_px

_FILTER_BLUR_PX = 1.3  # edge width of a sharp edge, from the filters alone
_BY_BLUR = 0.85  # px of error for a pixel of blur; measured on rendered films
_BY_LENGTH = 0.0025  # of the length: round tips
_LEAST_ERROR_PX = 0.35  # of a short body, whose tips are small


def edge_blur_px(level: Singles, threshold: float) -> float:
    """Blur of a body at its boundary: ``edge_width_px`` without the filters."""
    width = edge_width_px(level, threshold)
    return float(np.sqrt(max(width**2 - _FILTER_BLUR_PX**2, 0.0)))


def axis_error_px(blur_px: float, length_px: float) -> float:
    """Expected mean error of a point of a medial axis, from the blur of its tips."""
    return float(np.hypot(_BY_BLUR * blur_px, max(_BY_LENGTH * length_px, _LEAST_ERROR_PX)))
