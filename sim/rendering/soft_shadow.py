"""A soft shadow from three pictures of one view: the ground, the shadow's shape, and everything.

Shadow maps of the software renderer omit shadows close to the ground, and transparent patches show
every overlap. Here the shape is drawn in one bright colour and, blurred, darkens the ground where
it is visible.
"""

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Image

SHAPE_RGBA = (1.0, 0.0, 1.0, 1.0)
"""Colour of the shape; it is never shown."""
STRENGTH = 0.42
"""Share of the light that the shadow removes (ours)."""


_LEAST = 12


def soft_shadow(empty: Image, shape: Image, full: Image, blur_px: float = 2.5) -> Image:
    """Return the full picture with the shadow on its ground.

    All pictures are (H, W, 3): ``empty`` the ground, ``shape`` with the shadow's shape in a bright
    colour, ``full`` with the bodies. ``blur_px`` is the width of the edge.
    """
    shade = _differ(shape, empty).astype(np.float32)
    body = _differ(full, empty).astype(np.float32)
    share = cv2.GaussianBlur(shade, (0, 0), blur_px) * (1.0 - body)
    dark = full.astype(np.float32) * (1.0 - STRENGTH * share[..., None])
    return np.asarray(np.rint(dark), dtype=np.uint8)


def _differ(one: Image, other: Image) -> Bools:
    """(H, W) where two pictures differ by more than edge smoothing."""
    return np.asarray(cv2.absdiff(one, other).max(axis=-1) > _LEAST)
