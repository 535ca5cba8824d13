"""Matches between two positions over a set of scales ([KP] 3.3).

A forward motion enlarges the picture, so a patch of the first picture is compared with the second
one at several reduced sizes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Floats, Image, Ints, Singles
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, sampled

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
_RATIO = 0.85
"""Largest ratio of the distances of the two most similar descriptors (ours)."""
_KEYPOINTS = 3000
_LEAST_SEEN = 0.8
"""Share of a search region that the second picture shows (ours)."""


@dataclass(frozen=True, slots=True)
class ScaleMatches:
    """Pairs of pixels, with the scale of best similarity."""

    first_px: Floats
    """(n, 2) columns and rows in the first picture."""
    second_px: Floats
    """(n, 2) in the second one."""
    scale: Floats
    """(n,) elements of ``SCALES``: size in the second picture over size in the first."""


def grey(image: Image) -> Singles:
    """(H, W) grey levels."""
    return np.asarray(np.asarray(image, dtype=np.float32).mean(axis=2), dtype=np.float32)


def reduced(picture: Singles, scale: float) -> Singles:
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
    wide: float = _WIDE_SEARCH,
) -> ScaleMatches:
    """Match interest points of the first picture: ``argmax corr`` over places and scales.

    Args:
        first: model; points are chosen in its valid region.
        second: model at the next position.
        scales: the set S, from 1.
        wide: half the width of a search region, in picture widths.

    """
    grey_first = grey(first.image)
    two = grey(second.image)
    pyramid = [(scale, reduced(two, scale)) for scale in scales]
    kept = []
    for column, row in _corners(grey_first, first.valid, _RADIUS_PX):
        patch = _patch(grey_first, column, row, _RADIUS_PX)
        best = _best_match(patch, pyramid, np.array([column, row]), wide * grey_first.shape[1])
        if best is not None:
            kept.append((column, row, *best[:3]))
    return _as_matches(kept)


def similar_points(first: LocalModel, second: LocalModel) -> ScaleMatches:
    """Match keypoints by their descriptors (SIFT), which scale and rotation do not change (ours).

    The first keypoint of a pair is in the valid region of its model.
    """
    sift = cv2.SIFT_create(_KEYPOINTS, contrastThreshold=0.01)  # type: ignore[attr-defined]
    sides = [
        sift.detectAndCompute(grey(model.image).astype(np.uint8), mask)
        for model, mask in ((first, first.valid.astype(np.uint8)), (second, None))
    ]
    if any(len(keypoints) < 2 for keypoints, _ in sides):
        return _as_matches([])
    roots: list[Any] = [
        np.sqrt(d / np.maximum(d.sum(axis=1, keepdims=True), 1e-9)) for _, d in sides
    ]
    kept = []
    for best, rival in cv2.BFMatcher().knnMatch(roots[0], roots[1], k=2):
        if best.distance < _RATIO * rival.distance:
            one, two = sides[0][0][best.queryIdx], sides[1][0][best.trainIdx]
            kept.append((*one.pt, *two.pt, two.size / one.size))
    return _as_matches(kept)


def match_around(
    first: LocalModel, second: LocalModel, predicted_px: Floats, scale: Floats, radius_px: int
) -> ScaleMatches:
    """Match interest points around the places that geometry and a pose predict.

    The second picture is drawn in the pixels of the first one, so that the turn, the scale and the
    slope of each patch agree, before patches are compared.

    Args:
        first: model; points are chosen in its valid region.
        second: model at another position.
        predicted_px: (H, W, 2) places of the first model's points in the second picture, or NaN.
        scale: (H, W) size in the second picture over size in the first, or NaN.
        radius_px: half the width of the search region, in pixels of the first picture.

    """
    grey_first = grey(first.image)
    seen = _redrawn(grey(second.image), predicted_px, scale)
    wide = _RADIUS_PX + radius_px
    kept = []
    corners = _corners(grey_first, np.isfinite(seen), wide)
    for column, row in corners:
        region = _patch(seen, column, row, wide)
        is_seen = np.isfinite(region)
        if is_seen.mean() < _LEAST_SEEN:
            continue
        region = np.where(is_seen, region, region[is_seen].mean())
        patch = _patch(grey_first, column, row, _RADIUS_PX)
        likeness = np.asarray(cv2.matchTemplate(region, patch, cv2.TM_CCOEFF_NORMED), np.float32)
        y, x = divmod(int(likeness.argmax()), likeness.shape[1])
        value = float(likeness[y, x])
        if value < _LEAST_CORRELATION or not (0 < y < 2 * radius_px and 0 < x < 2 * radius_px):
            continue
        place = np.array(
            [
                column + x - radius_px + _vertex(likeness[y], x),
                row + y - radius_px + _vertex(likeness[:, x], y),
            ]
        )
        counterpart = _bilinear(predicted_px, place)
        if np.isfinite(counterpart).all():
            kept.append((column, row, *counterpart, scale[row, column]))
    return _as_matches(kept)


def _redrawn(picture: Singles, places_px: Floats, scale: Floats) -> Singles:
    """(H, W) samples of a picture at places, each from the reduction with the nearest scale."""
    nearest = np.full(scale.shape, -1)
    known = np.isfinite(places_px).all(axis=-1) & np.isfinite(scale)
    nearest[known] = np.abs(np.log(scale[known, None] / np.array(SCALES))).argmin(axis=1)
    out = np.full(scale.shape, np.nan)
    for k in np.unique(nearest[known]):
        chosen = nearest == k
        places = np.where(chosen[..., None], places_px, np.nan) / SCALES[k]
        drawn = sampled(reduced(picture, SCALES[k]), places)
        out[chosen] = drawn[chosen]
    return out.astype(np.float32)


def _bilinear(values: Floats, place_px: Floats) -> Floats:
    """(k,) sample of values (H, W, k) at a column and row inside."""
    (u, v), (a, b) = np.floor(place_px).astype(int), place_px % 1.0
    square = values[v : v + 2, u : u + 2]
    return np.asarray(np.einsum("i,j,ijk->k", [1 - b, b], [1 - a, a], square))


def _corners(picture: Singles, usable: Bools, margin_px: int) -> Ints:
    """(n, 2) columns and rows of the interest points in the usable part, inside a margin."""
    inside = np.zeros(picture.shape, np.uint8)
    edge = margin_px + 1
    inside[edge:-edge, edge:-edge] = usable[edge:-edge, edge:-edge]
    corners: Any = cv2.goodFeaturesToTrack(picture, _MOST_POINTS, 0.002, 8, mask=inside)
    places = np.zeros((0, 2)) if corners is None else np.asarray(corners, float).reshape(-1, 2)
    return np.asarray(np.rint(places), np.int64)


def _patch(picture: Singles, column: int, row: int, radius: int) -> Singles:
    return picture[row - radius : row + radius + 1, column - radius : column + radius + 1]


def _as_matches(rows: Sequence[Sequence[float]]) -> ScaleMatches:
    table = np.array(rows, dtype=float).reshape(-1, 5)
    return ScaleMatches(table[:, :2], table[:, 2:4], table[:, 4])


def _best_match(
    patch: Singles,
    pyramid: list[tuple[float, Singles]],
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


def _vertex(values: Singles, peak_index: int) -> float:
    """Offset of a parabola's vertex through a maximum and its neighbours."""
    if not 0 < peak_index < len(values) - 1:
        return 0.0
    below, peak, above = (float(value) for value in values[peak_index - 1 : peak_index + 2])
    curve = below - 2.0 * peak + above
    return 0.0 if curve >= 0.0 else 0.5 * (below - above) / curve
