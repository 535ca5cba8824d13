"""The skin's picture: the body in an image, unrolled to a strip along the skeleton ([PT] 2.2)."""

import numpy as np
from scipy.ndimage import map_coordinates

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.track.resample import SEGMENTS, equal_arc_length

ALONG, ACROSS = 512, 64
"""Pixels of the strip."""
_EYE_RGB = (0.05, 0.05, 0.05)
_MIXED_EDGE_PX = 0.75  # at the boundary pixels are partly background


def unroll(image: Image, points_px: Floats, radius_px: Floats) -> Image:
    """Sample an image (H, W) or (H, W, 3) across the body.

    Args:
        image: grey or colour.
        points_px: (P, 2) skeleton, x and y with rows downwards, head first; whole numbers are
            centres of pixels.
        radius_px: (P,) distances to the boundary.

    Returns:
        (64, 512, 3): head at the left, the body's left side in the first row.

    Raises:
        ValueError: fewer than 4 distinct points.

    """
    side = np.linspace(1.0, -1.0, ACROSS)
    colour = colours_across(image, points_px, radius_px, side[:, None], squeezed=True)
    return np.asarray(np.clip(np.rint(colour), 0, 255), dtype=np.uint8)


def colours_across(
    image: Image, points_px: Floats, radius_px: Floats, across: Floats, *, squeezed: bool = False
) -> Floats:
    """Sample an image (H, W) or (H, W, 3) at places across the body.

    Args:
        image: grey or colour.
        points_px: (P, 2) as for ``unroll``.
        radius_px: (P,) distances to the boundary.
        across: (R, 512) or (R, 1) places over the radius, 1 on the left of the heading.
        squeezed: fit the width between the mixed pixels at the boundary; else places beyond have
            the last pure pixel.

    Returns:
        (R, 512, 3)

    Raises:
        ValueError: fewer than 4 distinct points.

    """
    colour = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    arc = arc_lengths(points_px)
    even = equal_arc_length(points_px, SEGMENTS)
    station = np.linspace(0.0, 1.0, ALONG)
    along = np.linspace(0.0, 1.0, SEGMENTS + 1)
    centre = np.stack([np.interp(station, along, even[:, k]) for k in range(2)], axis=-1)
    radius = np.interp(station, arc / arc[-1], radius_px)
    pure = np.maximum(radius - _MIXED_EDGE_PX, 0.5 * radius)
    off = across * pure if squeezed else np.clip(across * radius, -pure, pure)
    forward = -np.gradient(centre, axis=0)
    forward /= np.hypot(*forward.T)[:, None]
    left = np.stack([forward[:, 1], -forward[:, 0]], axis=-1)  # rows count down
    place = centre[None] + off[..., None] * left[None]
    at_px = [place[..., 1], place[..., 0]]
    return np.stack(
        [
            map_coordinates(colour[..., k].astype(float), at_px, order=1, mode="nearest")
            for k in range(3)
        ],
        axis=-1,
    )


def painted(
    back_rgb: tuple[float, float, float],
    band_rgb: tuple[float, float, float],
    bands: int,
    eye_at: float,
    eye_radius: tuple[float, float],
) -> Image:
    """Paint a strip for a body without a picture: bands across, and an eye on each side.

    Args:
        back_rgb: colour, 0 to 1.
        band_rgb: of the bands, which are broadest over the back.
        bands: number.
        eye_at: place of the eyes along the body, 0 to 1.
        eye_radius: of an eye, over the body's length and over the half height of the body there.

    Returns:
        (256, 1024, 3), laid out as that of ``unroll``.

    """
    u = (np.arange(2 * ALONG) + 0.5) / (2 * ALONG)
    across = np.linspace(1.0, -1.0, 4 * ACROSS)[
        :, None
    ]  # cosine of the angle around: 1 is the left
    wave = np.cos(2.0 * np.pi * bands * u) - 0.3 - 0.9 * across**2
    share = np.clip(0.5 + 2.0 * wave, 0.0, 1.0)[..., None] if bands else np.zeros((1, 1, 1))
    strip = (1.0 - share) * np.array(back_rgb) + share * np.array(band_rgb)
    strip = np.broadcast_to(strip, (len(across), len(u), 3)).copy()
    height = np.sqrt(1.0 - across**2)
    eye = ((u - eye_at) / eye_radius[0]) ** 2 + (height / eye_radius[1]) ** 2 <= 1.0
    strip[eye] = _EYE_RGB
    return np.asarray(np.rint(255.0 * strip), dtype=np.uint8)
