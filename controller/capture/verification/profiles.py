"""Contrasts of one body in its own frame: along both sides, and beyond both tips."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import uniform_filter1d

from snakewalk.config.arrays import Floats, Singles
from snakewalk.controller.capture.verification.frame_store import CutOut
from snakewalk.controller.images.cross_profile import along_and_side, values_at
from snakewalk.controller.images.medial_axis import Skeleton

_INNER_HALF_WIDTH = 0.5  # of the half width on both sides of the line: the body
_FIRST_GAP_PX = 1.5  # off the boundary and half of the half width: the ground begins
_SAMPLES_ACROSS = 6  # samples of the ground on each side
_BODY_MARGIN_PX = 2.0  # nearer to another part of the body than its half width and this: no ground
_LEAST_HALF_WIDTHS_AWAY = 3.0  # half widths along the body from which a part is another one
_RINGS = 6  # distances beyond a tip
_RING_FROM, _RING_TO = (1.0, 1.5), (2.5, 3.0)  # widths and px from a tip
_FAN = np.radians(np.linspace(-70.0, 70.0, 29))
_INNER, _INSIDE = 6, 24  # stations from a tip: its direction, and where its contrast is looked at
_NEAR_TIP, _BODY = slice(2, 10), slice(10, 21)
_AT_TIP = slice(5, 16)  # stations that show a tip's width and contrast


@dataclass(frozen=True, slots=True)
class BodyProfile:
    """Values of a frame along a line; C channels, NaN where the frame shows no ground."""

    sides: Floats
    """(2, 101, C) ground minus body on each side."""
    rings: Floats
    """(2, rings, angles, C) ground minus picture beyond the first and the last tip."""
    noise: float
    """Standard deviation of a pixel of the ground, from neighbouring samples."""
    direction: Floats
    """(C,) unit weights of the channels, from ``sides``."""
    beyond_px: Floats
    """(2,) how far beyond the first and the last tip half of the contrast ends; below 0 within the
    body, NaN if it does not end."""


def body_profile(body: Skeleton, cut_out: CutOut) -> BodyProfile:
    """Measure a body with points in the part of its frame."""
    image = np.asarray(cut_out.image, dtype=np.float32)
    image = image[..., None] if image.ndim == 2 else image
    line = body.points_px - np.asarray(cut_out.origin_px, dtype=float)
    half = np.maximum(body.radius_px, 0.5)
    along, side = along_and_side(line)
    inner = np.linspace(-_INNER_HALF_WIDTH, _INNER_HALF_WIDTH, 3)
    on = _grey_values(
        image, line[:, None] + (inner * half[:, None])[..., None] * side[:, None]
    ).mean(1)
    first = 1.5 * half + _FIRST_GAP_PX
    reach = first[:, None] + np.linspace(0.0, 1.0, _SAMPLES_ACROSS) * np.maximum(half, 2.0)[:, None]
    grounds = []
    noise = []
    for sign in (1.0, -1.0):
        places = line[:, None] + sign * reach[..., None] * side[:, None]
        levels = _grey_values(image, places)
        levels[_lies_on_same_body(places, line, half)] = np.nan
        noise.append(np.diff(levels, axis=0).ravel())
        grounds.append(_mean(levels))
    steps = np.concatenate(noise)
    steps = steps[np.isfinite(steps)]
    spread = 1.4826 * float(np.median(np.abs(steps))) / np.sqrt(2.0) if steps.size else 0.0
    rings = [
        _rings(image, line[::order], half[::order], -along[0] if order > 0 else along[-1])
        for order in (1, -1)
    ]
    sides = np.stack(grounds) - on
    direction = direction_of(sides.reshape(-1, image.shape[2]))
    beyond = [_end_px(image, line[::order], half[::order], direction) for order in (1, -1)]
    return BodyProfile(sides, np.stack(rings), spread, direction, np.array(beyond))


def direction_of(contrasts: Floats) -> Floats:
    """(C,) unit weights of the channels from contrasts (N, C), NaN where unknown."""
    known = contrasts[np.isfinite(contrasts).all(axis=1)]
    direction = np.median(known, axis=0) if len(known) else np.zeros(contrasts.shape[1])
    return direction / max(float(np.linalg.norm(direction)), 1e-9)


def _end_px(image: Singles, line: Floats, half: Floats, direction: Floats) -> float:
    """Where half of the contrast of a line's first part ends, px beyond its first point."""
    wide = max(float(half[_NEAR_TIP].mean()), 1.0)
    outward = line[0] - line[_INNER]
    outward = outward / max(float(np.hypot(*outward)), 1e-9)
    chord = float(np.hypot(*np.diff(line[: _INSIDE + 1], axis=0).T).mean())
    away = np.arange(1.0, 6.0 * wide + 8.0) * 0.5
    places = np.vstack([line[_INSIDE::-1], line[0] + away[:, None] * outward])
    along = np.concatenate([-chord * np.arange(_INSIDE, -1.0, -1.0), away])
    levels = _grey_values(image, places[None])[0] @ direction
    known = np.isfinite(levels)
    along, levels = along[known], levels[known]
    contrast = np.median(levels[-len(away) // 3 :]) - levels
    least = 0.5 * float(np.median(contrast[_BODY])) if len(contrast) > _INSIDE else 0.0
    ends = np.flatnonzero((contrast[:-1] >= least) & (contrast[1:] < least))
    if least <= 0.0 or not len(ends):
        return float("nan")
    k = int(ends[-1])
    share = (contrast[k] - least) / (contrast[k] - contrast[k + 1])
    return float(along[k] + share * (along[k + 1] - along[k]))


def _mean(levels: Floats) -> Floats:
    """(P, C) mean over the samples (P, A, C) that show ground; NaN where fewer than half do."""
    is_known = np.isfinite(levels)
    count = is_known.sum(axis=1)
    total = np.where(is_known, levels, 0.0).sum(axis=1)
    return np.where(2 * count >= levels.shape[1], total / np.maximum(count, 1), np.nan)


def _lies_on_same_body(places: Floats, line: Floats, half: Floats) -> Floats:
    """(P, A) whether places next to the line lie on another part of the same body."""
    chord = float(np.hypot(*np.diff(line, axis=0).T).mean())
    away = max(2, int(np.ceil(_LEAST_HALF_WIDTHS_AWAY * float(half.max()) / max(chord, 1e-9))) + 4)
    square = _squares(places, line)
    number = np.arange(len(line))
    other = np.abs(number[:, None] - number) >= away
    near = square < (half + _BODY_MARGIN_PX) ** 2
    return np.asarray((near & other[:, None]).any(axis=-1))


def _squares(places: Floats, line: Floats) -> Floats:
    """(P, A, Q) squared distances of places (P, A, 2) from the points of a line (Q, 2)."""
    x = places[..., 0, None] - line[:, 0]
    y = places[..., 1, None] - line[:, 1]
    return x * x + y * y


def _rings(image: Singles, line: Floats, half: Floats, outward: Floats) -> Floats:
    """(rings, angles, C) ground minus picture beyond the first point of a line."""
    wide = 2.0 * float(half[_AT_TIP].mean())
    low, high = _RING_FROM[0] * wide + _RING_FROM[1], _RING_TO[0] * wide + _RING_TO[1]
    away = np.linspace(low, high, _RINGS)
    angle = np.arctan2(outward[1], outward[0]) + _FAN
    unit = np.column_stack([np.cos(angle), np.sin(angle)])
    places = line[0] + away[:, None, None] * unit
    levels = _grey_values(image, places)
    square = _squares(places, line[_AT_TIP.stop :])
    levels[(square < (half[_AT_TIP.stop :] + _BODY_MARGIN_PX) ** 2).any(axis=-1)] = np.nan
    is_known = np.asarray(np.isfinite(levels).all(axis=-1))
    out = np.full(levels.shape, np.nan)
    for k, ring in enumerate(levels):
        if is_known[k].sum() > len(_FAN) // 2:
            usual = np.median(ring[is_known[k]], axis=0)
            filled_ring = np.where(is_known[k][:, None], ring, usual)
            out[k] = usual - uniform_filter1d(filled_ring, 3, axis=0, mode="nearest")
    return out


def _grey_values(image: Singles, places: Floats) -> Floats:
    """(..., C) grey values at places (A, B, 2); NaN outside the image."""
    levels = values_at(image, places, cv2.BORDER_REPLICATE)
    rounded = places.astype(np.float32)
    last = np.subtract(image.shape[1::-1], 1)
    levels[((rounded < 0) | (rounded > last)).any(axis=-1)] = np.nan
    return levels
