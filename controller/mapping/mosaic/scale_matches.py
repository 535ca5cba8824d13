"""Matches between two positions over a set of scales ([KP] 3.3).

A forward motion enlarges the picture, so a patch of the first picture is compared with the second
one at several reduced sizes.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, project

SCALES = tuple(10.0 / k for k in range(10, 0, -1))
"""Scales of the set S of the paper: 1, 1 / 0.9, ..., 1 / 0.1."""
_MOST_POINTS = 500
_RADIUS_PX = 7
"""Patches are 15 px wide (ours)."""
_LEAST_CORRELATION = 0.75
_UNIQUE = 0.03
"""Least lead of the best correlation over any other that is more than a patch's radius away
(ours)."""
_WIDE_SEARCH = 0.35
"""Half the width of the search region, in widths of the picture, without a guess (ours)."""
_NARROW_SEARCH = 0.12
"""Search radius around the place that a guess of the distance predicts (ours)."""


@dataclass(frozen=True, slots=True)
class ScaleMatches:
    """Pairs of pixels, with the scale of best similarity."""

    first_px: Floats
    """(n, 2) columns and rows in the first picture."""
    second_px: Floats
    """(n, 2) in the second one."""
    scale: Floats
    """(n,) elements of ``SCALES``: size in the second picture over size in the first."""
    correlation: Floats
    """(n,) correlations of the pairs."""


def grey(image: Image) -> NDArray[np.float32]:
    """(H, W) grey levels."""
    return np.asarray(np.asarray(image, dtype=np.float32).mean(axis=2), dtype=np.float32)


def reduced(picture: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    """Picture at size ``1 / scale``; pixel centre (u, v) maps to (u / scale, v / scale)."""
    if scale == 1.0:
        return picture
    sigma = 0.5 * np.sqrt(scale**2 - 1.0)
    smooth = cv2.GaussianBlur(picture, (0, 0), sigma)
    tall, wide = (int((n - 1) / scale) + 1 for n in picture.shape)
    shrink = np.array([[scale, 0.0, 0.0], [0.0, scale, 0.0]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpAffine(smooth, shrink, (wide, tall), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    )


def match_over_scale(
    first: LocalModel,
    second: LocalModel,
    scales: tuple[float, ...] = SCALES,
    distance_m: float | None = None,
    wide: float = _WIDE_SEARCH,
) -> ScaleMatches:
    """Match interest points of the first picture: ``argmax corr`` over places and scales.

    Args:
        first: model; points are chosen in its valid region.
        second: model at the next position.
        scales: the set S, from 1.
        distance_m: approximate way forward; it narrows the search regions.
        wide: half the width of a search region without it, in picture widths.

    """
    grey_first = grey(first.image)
    two = grey(second.image)
    pyramid = [(scale, reduced(two, scale)) for scale in scales]
    inside = np.zeros(grey_first.shape, np.uint8)
    edge = _RADIUS_PX + 1
    inside[edge:-edge, edge:-edge] = first.valid[edge:-edge, edge:-edge]
    corners = cv2.goodFeaturesToTrack(grey_first, _MOST_POINTS, 0.002, 8, mask=inside)
    places = np.zeros((0, 2)) if corners is None else np.asarray(corners, float).reshape(-1, 2)
    columns, rows = np.rint(places).astype(int).T if len(places) else np.zeros((2, 0), int)
    centres = places
    half = wide
    if distance_m is not None:
        ahead = first.points_m[rows, columns] - [0.0, 0.0, distance_m]
        centres = project(second.camera, ahead)
        half = _NARROW_SEARCH
    kept = []
    for k, (column, row) in enumerate(zip(columns, rows, strict=True)):
        if not np.isfinite(centres[k]).all():
            continue
        patch = grey_first[row - _RADIUS_PX : row + _RADIUS_PX + 1, column - _RADIUS_PX :][
            :, : 2 * _RADIUS_PX + 1
        ]
        best = _best_match(patch, pyramid, centres[k], half * grey_first.shape[1])
        if best is not None:
            kept.append((column, row, *best))
    table = np.array(kept, dtype=float).reshape(-1, 6)
    return ScaleMatches(table[:, :2], table[:, 2:4], table[:, 4], table[:, 5])


def _best_match(
    patch: NDArray[np.float32],
    pyramid: list[tuple[float, NDArray[np.float32]]],
    centre: Floats,
    half_px: float,
) -> tuple[float, float, float, float] | None:
    """Column, row, scale and correlation of the best match; None if not unique."""
    vertices: list[tuple[float, float, float, float]] = []
    rivals: list[tuple[float, float, float]] = []
    for scale, picture in pyramid:
        low = np.floor((centre - half_px) / scale).astype(int) - _RADIUS_PX
        high = np.ceil((centre + half_px) / scale).astype(int) + _RADIUS_PX + 1
        left, top = np.maximum(low, 0)
        region = picture[top : max(high[1], 0), left : max(high[0], 0)]
        if min(region.shape) < 2 * _RADIUS_PX + 3:
            continue
        likeness = np.asarray(cv2.matchTemplate(region, patch, cv2.TM_CCOEFF_NORMED), np.float32)
        row, column = divmod(int(likeness.argmax()), likeness.shape[1])
        top_value = float(likeness[row, column])
        fine_row = row + _vertex(likeness[:, column], row)
        fine_column = column + _vertex(likeness[row], column)
        u = float(fine_column + left + _RADIUS_PX) * scale
        v = float(fine_row + top + _RADIUS_PX) * scale
        vertices.append((u, v, scale, top_value))
        near = slice(max(row - _RADIUS_PX, 0), row + _RADIUS_PX + 1)
        near_columns = slice(max(column - _RADIUS_PX, 0), column + _RADIUS_PX + 1)
        likeness[near, near_columns] = -1.0
        row, column = divmod(int(likeness.argmax()), likeness.shape[1])
        rivals.append(
            (
                float(column + left + _RADIUS_PX) * scale,
                float(row + top + _RADIUS_PX) * scale,
                float(likeness[row, column]),
            )
        )
    if not vertices:
        return None
    best = max(vertices, key=lambda vertex: vertex[3])
    others = [*((u, v, value) for u, v, _, value in vertices), *rivals]
    likeness_values = [
        value
        for u, v, value in others
        if np.hypot(u - best[0], v - best[1]) > 1.5 * _RADIUS_PX * best[2]
    ]
    if best[3] < _LEAST_CORRELATION or best[3] < max(likeness_values, default=-1.0) + _UNIQUE:
        return None
    return best


def _vertex(values: NDArray[np.float32], peak_index: int) -> float:
    """Offset of a parabola's vertex through a maximum and its neighbours."""
    if not 0 < peak_index < len(values) - 1:
        return 0.0
    below, peak, above = (float(value) for value in values[peak_index - 1 : peak_index + 2])
    curve = below - 2.0 * peak + above
    return 0.0 if curve >= 0.0 else 0.5 * (below - above) / curve
