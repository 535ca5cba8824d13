"""A faint tail beyond the end of a silhouette, followed along its ridge of contrast.

A tail that is fainter than half of the body's contrast, or fainter than a pixel's noise, still
stands out in the mean over a few pixels along it. Each step turns towards the direction in which
the ridge is clearest; the turn of a step is bounded, so the path cannot curl round an eye.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Bools, DeepImage, Floats, Singles
from snakewalk.controller.images.cross_profile import values_at
from snakewalk.controller.images.faint_parts import FAINTEST
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, in_equal_chords
from snakewalk.controller.images.resting import Neighbours, resting_mean
from snakewalk.controller.images.silhouette import Polarity, Silhouette, contrast
from snakewalk.controller.kinematics.arc_length import arc_lengths

_DIRECTION_PX = 9.0  # length of the rays that are compared
_RADIUS_PX = 9.0  # smallest radius of a bend
_FAN = np.linspace(-1.0, 1.0, 21)  # directions of the rays that are compared
_FAN_RAD = 0.7  # largest turn of a ray
_GROUND_GAP_PX = 2.5  # beyond the half width: the ground on both sides of the ridge
_CLEAR = 3.0  # standard deviations of a ray on bare ground
_MOST_LENGTHENING = 2.0  # times the length of the silhouette's line: a longer tail is a trail
_AVERAGED_STEPS = 6  # steps whose clearness is the usual one at the tip
_UNSURE = 2.0  # clearness of a tail that may go on below the limit for stains (ours)
_SAMPLES = 400  # rays on bare ground
_LEAST_LENGTH_PX = 4.0  # a shorter extension is ignored
_THINNEST_PX, _WIDEST_PX = 1.0, 3.0  # half width of a tail
_MARGIN_LENGTHS, _MARGIN_PX = 2.0, 20  # lengths of the silhouette, and px: where tails lie
_FREE_DISTANCE_PX = 12.0  # from the silhouette: bare ground, but for the tail
_END_STATIONS = 10  # of the skeleton: the width at its end
_SMOOTH = 2.0  # stations
_DRAWN = 1.2  # of the threshold: contrast that the silhouette receives along the tail
_TIP = 1.5  # of the ray over its clearness: error of the tip (measured on one film of a larva)


@dataclass(frozen=True, slots=True)
class TailTip:
    """Accuracy of the tip of a faint tail, along the body."""

    error_px: float
    """Expected error in the frame alone."""
    lengthening_px: float
    """Length that the mean of resting frames adds to that of the frame alone."""


@dataclass(frozen=True, slots=True)
class TailedBody:
    """A body with the faint tail beyond the end of its silhouette."""

    silhouette: Silhouette
    skeleton: Skeleton
    tip: TailTip


@dataclass(frozen=True, slots=True)
class FollowedTail:
    """The continuation of a line."""

    points: Floats
    """(K, 2) from the end of the line to the tip, one pixel apart."""
    clearness: float
    """Median contrast of the ridge over its noise; less if it ends at the limit for stains, because
    the tail may go on."""


def follow_tail(
    level: Singles, line: Floats, half_px: float, away_px: Floats, faintest: float
) -> FollowedTail | None:
    """Follow a ridge beyond the last point of a line; None if nothing goes on there.

    A ridge that leads back into the silhouette is not a tail.

    Args:
        level: (h, w) contrast around the body, with its ground.
        line: (P, 2) x, y; its last point is the end of the silhouette.
        half_px: half width of the body at that end.
        away_px: (h, w) distance from the silhouette; the noise is learnt far from it.
        faintest: contrast of a ray below which it is a stain or a trail.

    """
    half = float(np.clip(half_px, _THINNEST_PX, _WIDEST_PX))
    noise = _noise(level, half, away_px > _FREE_DISTANCE_PX)
    if noise is None:
        return None
    is_limited = noise < faintest / _CLEAR
    noise = max(noise, faintest / _CLEAR)
    length = float(arc_lengths(line)[-1])
    back = max(1, round(_DIRECTION_PX * (len(line) - 1) / max(length, 1e-6)))
    ahead = line[-1] - line[max(0, len(line) - 1 - back)]
    angle = float(np.arctan2(ahead[1], ahead[0]))
    tip = line[-1]
    points: list[Floats] = []
    clear = [0.0]
    rows, columns = level.shape
    for _ in range(round(_MOST_LENGTHENING * length)):
        directions = angle + _FAN_RAD * _FAN
        ridge_levels = (
            _ridge(level, np.broadcast_to(tip, (len(directions), 2)), directions, half) / noise
        )
        best = int(np.argmax(ridge_levels - np.abs(_FAN)))
        angle += float(np.clip(_FAN_RAD * _FAN[best], -1.0 / _RADIUS_PX, 1.0 / _RADIUS_PX))
        unit = np.array([np.cos(angle), np.sin(angle)])
        if ridge_levels[best] < _CLEAR:
            # a ray that only begins on the tail is as clear as its part on the tail is long
            usual = float(np.mean(clear[-_AVERAGED_STEPS:]))
            ahead_px = _DIRECTION_PX * min(1.0, float(ridge_levels[best]) / max(usual, _CLEAR))
            points.extend(tip + k * unit for k in np.arange(1.0, ahead_px + 0.5))
            break
        tip = tip + unit
        if not (0.0 <= tip[0] < columns and 0.0 <= tip[1] < rows):
            break
        points.append(tip)
        clear.append(float(ridge_levels[best]))
    if len(clear) - 1 < _LEAST_LENGTH_PX or _returns(np.array(points), away_px):
        return None
    clearness = float(np.median(clear[1:]))
    if is_limited:
        clearness = min(clearness, _UNSURE)
    return FollowedTail(np.array(points), clearness)


def _ridge(level: Singles, start: Floats, directions: Floats, half: float) -> Floats:
    """(W,) mean contrast along a ray from each point (W, 2), less that of its clearer side."""
    along = np.arange(1.0, _DIRECTION_PX + 1.0)
    unit = np.column_stack([np.cos(directions), np.sin(directions)])
    side = np.column_stack([-unit[:, 1], unit[:, 0]])
    middle = start[:, None] + along[None, :, None] * unit[:, None]
    ring = half + _GROUND_GAP_PX
    across = np.array([-0.5 * half, 0.0, 0.5 * half, -ring, ring])
    places = middle[:, :, None] + across[:, None] * side[:, None, None]
    shown_level = values_at(level, places, cv2.BORDER_REPLICATE).mean(axis=1)
    return np.asarray(shown_level[:, :3].mean(axis=1) - shown_level[:, 3:].max(axis=1))


def _returns(points: Floats, away_px: Floats) -> bool:
    """Whether a path (K, 2) leaves the silhouette and enters it again."""
    rows, columns = away_px.shape
    x, y = np.clip(np.rint(points).astype(int), 0, [columns - 1, rows - 1]).T
    outside = away_px[y, x] > 0.0
    return bool((~outside[int(np.argmax(outside)) :]).any() and outside.any())


def _noise(level: Singles, half: float, free: Bools) -> float | None:
    """Standard deviation of ``_ridge`` on bare ground; None if there is too little of it."""
    y, x = np.nonzero(free)
    if len(x) < _SAMPLES:
        return None
    some = np.linspace(0, len(x) - 1, _SAMPLES).round().astype(int)
    directions = np.linspace(0.0, 12.0 * np.pi, _SAMPLES)
    ridge = _ridge(level, np.column_stack([x[some], y[some]]).astype(float), directions, half)
    return float(1.4826 * np.median(np.abs(ridge - np.median(ridge))))


def with_tails(
    image: DeepImage,
    background: DeepImage,
    polarity: Polarity,
    body: Silhouette,
    body_skeleton: Skeleton,
    neighbours: Neighbours = (),
) -> TailedBody | None:
    """Return the body with the faint tail beyond either end; None if nothing goes on there.

    The tail of a resting animal is followed in the mean of the frame and its neighbours. Frames of
    a compressed film share their faults, so the expected error is that of the frame alone.

    Args:
        image: (H, W[, 3]) the frame.
        background: the same without the animal.
        polarity: whether the animal is darker or lighter than its ground.
        body: the part above half of the contrast.
        body_skeleton: its skeleton.
        neighbours: frames before and after, the animal alone in them.

    """
    around = round(_MARGIN_LENGTHS * body_skeleton.length_px) + _MARGIN_PX
    window = body.window(around)
    corner = np.array([window[1].start, window[0].start], dtype=float)
    ground = background[window]
    level = _level(image[window], ground, polarity)
    mask = np.zeros(level.shape, dtype=np.uint8)
    inner = body.window_within(window)
    mask[inner] = body.mask
    away_px = np.asarray(cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5), dtype=float)
    faintest = 2.0 * FAINTEST * body.threshold
    core = replace(body_skeleton, points_px=body_skeleton.points_px - corner)
    single = tailed = _with_both_tails(level, core, away_px, faintest)
    mean = resting_mean(image, neighbours, body, window)
    if mean is not None:
        mean_level = _level(mean, ground.astype(np.float32), polarity)
        tailed = _with_both_tails(mean_level, core, away_px, faintest)
    if not tailed.added:
        return None
    line = tailed.points
    smooth = gaussian_filter1d(line, _SMOOTH, axis=0, mode="nearest")
    arc = arc_lengths(line)
    smooth = np.vstack([line[:1], smooth, line[-1:]]) + corner
    shares = np.linspace(0.0, arc[-1], SEGMENTS + 1)
    skeleton = in_equal_chords(smooth, np.interp(shares, arc, tailed.radius_px))
    if skeleton is None:
        return None
    body_level = np.zeros(level.shape, dtype=np.float32)
    body_level[inner] = body.level
    for points in tailed.added:
        cv2.polylines(
            mask, [np.rint(points).astype(np.int32)], isClosed=False, color=2, thickness=3
        )
    body_level[mask == 2] = np.maximum(body_level[mask == 2], _DRAWN * body.threshold)
    area = float(np.count_nonzero(body_level > body.threshold))
    x, y = corner.tolist()
    silhouette = replace(body, level=body_level, origin_px=(x, y), area_px=area)
    lengthening_px = float(arc[-1] - arc_lengths(single.points)[-1])
    tip = TailTip(_TIP * _DIRECTION_PX / single.clearness, lengthening_px)
    return TailedBody(silhouette, skeleton, tip)


def _level(picture: DeepImage, ground: DeepImage, polarity: Polarity) -> Singles:
    return np.asarray(contrast(picture, ground, polarity), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class _TailedLine:
    """A line with the tails beyond its ends."""

    points: Floats
    radius_px: Floats
    added: list[Floats]
    """Points of each tail."""
    clearness: float
    """Clearness of the less clear tail; that of an unsure one without a tail."""


def _with_both_tails(
    level: Singles, core: Skeleton, away_px: Floats, faintest: float
) -> _TailedLine:
    """The line of a skeleton with its tails; the arguments are those of ``follow_tail``."""
    line, radius = core.points_px, core.radius_px
    tails: list[FollowedTail] = []
    for _ in range(2):
        end = float(np.median(radius[-_END_STATIONS:]))
        tail = follow_tail(level, line, end, away_px, faintest)
        if tail is not None:
            tails.append(tail)
            line = np.vstack([line, tail.points])
            radius = np.concatenate([radius, np.linspace(end, _THINNEST_PX, len(tail.points))])
        line, radius = line[::-1], radius[::-1]
    clearness = min((tail.clearness for tail in tails), default=_UNSURE)
    return _TailedLine(line, radius, [tail.points for tail in tails], clearness)
