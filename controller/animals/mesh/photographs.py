"""A skin's picture from several photographs, around the whole body ([PT] 2.2).

Each point of the skin has the weighted mean of the photographs that see it. The weight falls with
the angle between the skin and the camera. If none sees it, the picture is mirrored.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse.csgraph import connected_components

from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.controller.animals.mesh.body_model import BodyModel
from snakewalk.controller.animals.mesh.skin_texture import ALONG, colours_across

AROUND = 256
"""Rows of a picture around the body, from the belly over the right side and the back."""
VIEWS = {"left": 0.0, "top": 0.5 * math.pi, "right": math.pi, "below": -0.5 * math.pi}
"""Directions from the body to the camera, angles around the body: 0 is its left side."""
_GRAZING = math.cos(math.radians(75.0))
"""Least cosine between the skin and the camera at which a photograph shows it (ours)."""
_LEAST_COMPARED_COSINE = math.cos(math.radians(65.0))
"""Least cosine at which brightnesses are compared (ours)."""
_LEAST_COMMON_POINTS = 200
"""Least number of points that two photographs show, to compare their brightness (ours)."""
_TONES = (8.0, 247.0)
"""Values that are neither black nor overexposed."""
_FEATHER = 1e-4
"""Weight of a mirrored point over a seen one: it fades in where the seen one fades out."""


@dataclass(frozen=True, slots=True)
class Photograph:
    """The body in a picture."""

    image: Image
    """(H, W) or (H, W, 3)"""
    points_px: Floats
    """(P, 2) skeleton in the photograph, rows downwards, head first."""
    radius_px: Floats
    """(P,) distances to the boundary."""
    turn_rad: float
    """Direction to the camera, an angle around the body; one of ``VIEWS``, or between."""


@dataclass(frozen=True, slots=True)
class PictureAround:
    """A picture of the whole skin."""

    picture: Image
    """(AROUND, ALONG, 3), head at the left; the first row is the belly, then the right side."""
    seen: float
    """Share of the skin's area that a photograph shows; the rest is mirrored."""
    gains: tuple[tuple[float, float, float] | None, ...]
    """Factor on red, green and blue of each photograph that makes it as bright as the first; None
    if it shares no skin with another one."""


def blend(photographs: Sequence[Photograph], model: BodyModel) -> PictureAround:
    """Blend photographs of one body, matched in brightness to the first.

    Raises:
        ValueError: a skeleton has fewer than 4 distinct points.

    """
    turn = row_turn_rad()
    even = np.linspace(0.0, 1.0, len(model.half_width))
    station = np.linspace(0.0, 1.0, ALONG)
    wide, high = (
        np.maximum(np.interp(station, even, half), 1e-6)
        for half in (model.half_width, model.half_height)
    )
    colours = []
    cosines = []
    for photograph in photographs:
        across, cosine = _place_in_view(photograph.turn_rad, turn[:, None], wide, high)
        colours.append(
            colours_across(photograph.image, photograph.points_px, photograph.radius_px, across)
        )
        cosines.append(cosine)
    colour = np.array(colours)
    cosine = np.array(cosines)
    gains = _gains(colour, cosine)
    factor = np.array([(1.0, 1.0, 1.0) if gain is None else gain for gain in gains])
    weight = np.clip((cosine - _GRAZING) / (1.0 - _GRAZING), 0.0, None) ** 2
    total = weight.sum(axis=0)
    mean = np.einsum("krc,krcx->rcx", weight, colour * factor[:, None, None])
    area = np.hypot(wide * np.sin(turn)[:, None], high * np.cos(turn)[:, None])
    seen_share = float((area * (total > 0.0)).sum() / area.sum())
    picture = np.clip(np.rint(_filled_colours(mean, total)), 0, 255).astype(np.uint8)
    return PictureAround(picture, seen_share, gains)


def row_turn_rad() -> Floats:
    """(AROUND,) angles around the body of the picture's rows: -90 degrees is the belly."""
    share = 1.0 - (np.arange(AROUND) + 0.5) / AROUND
    return 2.0 * np.pi * (share - 0.25)


def _place_in_view(
    camera_rad: float, turn: Floats, wide: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Place across the body in a picture, 1 on the left of its heading, and cosine of the view."""
    side = math.sin(camera_rad)
    up = -math.cos(camera_rad)  # to the left in the picture
    half = np.hypot(wide * side, high * up)
    across = (wide * np.cos(turn) * side + high * np.sin(turn) * up) / half
    normal = np.stack(np.broadcast_arrays(np.cos(turn) / wide, np.sin(turn) / high))
    normal /= np.hypot(*normal)
    return across, normal[0] * math.cos(camera_rad) + normal[1] * math.sin(camera_rad)


def _gains(colour: Floats, cosine: Floats) -> tuple[tuple[float, float, float] | None, ...]:
    """Factors that make photographs (K, R, C, 3) equally bright where two show the same skin."""
    count = len(colour)
    usable = (cosine > _LEAST_COMPARED_COSINE) & ((colour > _TONES[0]) & (colour < _TONES[1])).all(
        axis=-1
    )
    rows = []
    differences = []
    joined = np.eye(count, dtype=bool)
    for i in range(count):
        for k in range(i + 1, count):
            both = usable[i] & usable[k]
            if both.sum() < _LEAST_COMMON_POINTS:
                continue
            row = np.zeros(count)
            row[i], row[k] = 1.0, -1.0
            rows.append(row)
            differences.append(np.median(np.log(colour[k][both] / colour[i][both]), axis=0))
            joined[i, k] = joined[k, i] = True
    _, group = connected_components(joined)
    if rows:
        first = np.eye(count)[0]
        log = np.linalg.lstsq(
            np.array([*rows, first]), np.array([*differences, np.zeros(3)]), rcond=None
        )[0]
    else:
        log = np.zeros((count, 3))
    gains = np.exp(log - log[0])
    return tuple(
        (float(r), float(g), float(b)) if is_reached else None
        for (r, g, b), is_reached in zip(gains, group == group[0], strict=True)
    )


def _filled_colours(mean: Floats, total: Floats) -> Floats:
    """Colours (R, C, 3) of weighted sums: seen, else mirrored, else of the nearest row."""
    row = np.arange(AROUND)
    back_and_belly = (AROUND // 2 - 1 - row) % AROUND
    left_and_right = AROUND - 1 - row
    sums = mean.copy()
    weights = total.copy()
    share = 1.0
    for mirrored in (back_and_belly, left_and_right, (row + AROUND // 2) % AROUND):
        share *= _FEATHER
        sums += share * mean[mirrored]
        weights += share * total[mirrored]
    is_known: Bools = weights > 0.0
    colour = sums / np.where(is_known, weights, 1.0)[..., None]
    if is_known.all():
        return colour
    three = np.tile(~is_known, (3, 1))
    place = distance_transform_edt(
        three, sampling=(1.0, 4.0 * AROUND), return_distances=False, return_indices=True
    )
    nearest, column = place[:, AROUND : 2 * AROUND]
    return np.asarray(colour[nearest % AROUND, column])
