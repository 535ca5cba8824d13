"""Error of a medial axis: blur moves the threshold's tips along the body."""

import cv2
import numpy as np
from numpy.typing import NDArray

_FILTER_BLUR_PX = 1.3  # edge width of a sharp edge, from the filters alone
_BY_BLUR = 0.85  # px of error for a pixel of blur; measured on rendered films
_BY_LENGTH = 0.0025  # of the length: round tips
_LEAST_ERROR_PX = 0.35


def edge_blur_px(level: NDArray[np.float32], threshold: float) -> float:
    """Blur of a body's boundary: standard deviation of an equally blurred step.

    It is contrast over steepness at the boundary, less the blur of the filters.

    Args:
        level: (h, w) contrast of one body.
        threshold: contrast at the boundary, half of the body's own.

    """
    mask = (level > threshold).astype(np.uint8)
    edge = (mask - cv2.erode(mask, np.ones((3, 3), np.uint8))) > 0
    across = cv2.Sobel(level, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(level, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    steep = float(np.median(np.hypot(across, down)[edge]))
    width = float(2.0 * threshold / (np.sqrt(2.0 * np.pi) * max(steep, 1e-6)))
    return float(np.sqrt(max(width**2 - _FILTER_BLUR_PX**2, 0.0)))


def axis_error_px(blur_px: float, length_px: float) -> float:
    """Expected mean error of a point of a medial axis, from the blur of its tips."""
    return float(np.linalg.norm([_BY_BLUR * blur_px, _BY_LENGTH * length_px, _LEAST_ERROR_PX]))
