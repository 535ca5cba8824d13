"""The medial axis of a silhouette as one ordered curve from tip to tip ([PT] 2.3).

The body is thinned at a fixed working width, so that the cost does not depend on its size. The
longest path between two ends drops side branches. It is then centred and extended to both tips.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d
from skimage.morphology import skeletonize

from snakewalk.config.arrays import Bools, Floats, Image, Ints, Singles
from snakewalk.controller.images.cross_profile import along_and_side, values_at
from snakewalk.controller.images.equipartition import NoEquipartitionError, equipartition
from snakewalk.controller.images.pointed_tips import to_pointed_tips
from snakewalk.controller.images.thin_body_fit import THIN_PX, fitted
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.drivers.compiling import compiled

Level = Singles
SEGMENTS = 100
_MARGIN = 3
_LARGEST_SIDE_PX = 8000  # largest side of the enlarged cut-out
_HOLE = 0.35  # squares of the width: a larger hole is a loop of the body
_THIN_TIP = 0.2  # share of the contrast that ends a body two pixels wide: blur hides its tips
_UNSURE_PX = 4.5  # a thinner body needs a fit of its blurred picture
_POINTED_WIDTH_PX = 3.5  # tips of a thinner body come from its fit
_UNIFORM = 0.85  # of the working width: a deeper body has a wide part
_LONG_WIDTHS = 2.5  # widths: a shorter object is not a long body
_BRANCH = 0.14  # of the length: a longer side branch is a part of the body
WORKING_WIDTH = 14.0
"""Width of the body while it is thinned, px."""
_SMOOTH = 3.0  # of the chain of pixels, working px
_CENTRINGS = 2
_MOST_TURN = float(np.tan(np.radians(37.0)))  # of that way from the line's own end: beyond lies an
# eye, or another part next to the body (tried on a film of a larva)
_WIDE_END = 1.35  # of the median depth: an end with a deeper place is a head with eyes on its sides
_NEAR_END = 0.3  # of the axis: that place lies nearer to the end
_SHORT_END = 4.5  # depths, from that place to the end of the axis
_AS_DEEP = 0.85  # of the largest depth: the eyes are about as wide as the place between them
_HOOK_COSINE = float(np.cos(np.radians(18.0)))  # the axis turns there into one half of the wide end
_REACH = 3.0  # depths from that place: pixels of the wide end
_FRONT = 95.0  # percentile of the pixels ahead of the place: the front of a wide end


@dataclass(frozen=True, slots=True)
class Skeleton:
    """A body in one image; pixels of that image, x to the right and y downwards."""

    points_px: Floats
    """(101, 2) x, y at 100 equal chords from tip to tip; NaN without a skeleton. Which end is the
    head, ``identity`` decides. A pixel's centre has whole coordinates."""
    radius_px: Floats
    """(101,) distance to the boundary."""
    length_px: float
    """Sum of the chords; NaN without a skeleton."""
    status: FrameStatus

    def reversed(self) -> "Skeleton":
        """Return the body from its other end."""
        return Skeleton(
            self.points_px[::-1].copy(), self.radius_px[::-1].copy(), self.length_px, self.status
        )


@dataclass(frozen=True, slots=True)
class _WideEnd:
    """An end with two halves, such as eyes; working px."""

    place: Floats
    """(2,) where the axis enters one half."""
    deep: float
    """Distance of that place from the boundary."""
    length: float
    """Length of the axis from that place to the front."""


def no_skeleton(status: FrameStatus) -> Skeleton:
    """Skeleton of an unusable frame: all NaN."""
    nan = np.full((SEGMENTS + 1, 3), np.nan)
    return Skeleton(nan[:, :2].copy(), nan[:, 2].copy(), float("nan"), status)


def in_equal_chords(line: Floats, radius_px: Floats) -> Skeleton | None:
    """Skeleton along a line (P, 2), with radii (R,) of even steps; None if nothing divides it."""
    try:
        even = equipartition(line, SEGMENTS)
    except (NoEquipartitionError, ValueError):
        return None
    shares = np.linspace(0.0, len(radius_px) - 1.0, SEGMENTS + 1)
    radii = np.interp(shares, np.arange(len(radius_px)), radius_px)
    return Skeleton(even.points, radii, even.chord * SEGMENTS, FrameStatus.GOOD)


def skeleton_of(mask: Bools) -> Skeleton:
    """Skeleton of a body given as a mask (H, W) of one component, with or without holes.

    Never raises: an empty, round, looped or branching mask has a status other than ``GOOD``, and
    NaN points. The order of the ends is arbitrary.
    """
    if not mask.any():
        return no_skeleton(FrameStatus.NOTHING)
    level = np.pad(mask.astype(np.float32), _MARGIN)
    return skeleton_of_level(level, 0.5, (-float(_MARGIN), -float(_MARGIN)), grey=False)


def skeleton_of_level(
    level: Level,
    threshold: float,
    origin_px: tuple[float, float],
    noise_level: float = 0.0,
    *,
    grey: bool = True,
) -> Skeleton:
    """Skeleton of the largest part of ``level`` (h, w) above ``threshold``; finer than from a mask.

    Args:
        level: contrast of one body, cut out of an image.
        threshold: contrast at the body's boundary.
        origin_px: x, y of the cut-out's first pixel in the image.
        noise_level: contrast that noise alone reaches; tips lie above it.
        grey: whether ``level`` is blurred at the boundary; a mask is not.

    """
    width = _width(level > threshold)
    if width is None:
        return no_skeleton(FrameStatus.BLOB)
    step = min(WORKING_WIDTH / width, _LARGEST_SIDE_PX / max(level.shape))
    framed = np.pad(resized(level, step), _MARGIN)
    fine = np.asarray(cv2.GaussianBlur(framed, (0, 0), 1.0), dtype=np.float32)
    solid = _largest_part(fine > threshold)
    if solid is None:
        return no_skeleton(FrameStatus.NOTHING)
    solid, looped = _filled_holes(solid, _HOLE * WORKING_WIDTH**2)
    if looped:
        return no_skeleton(FrameStatus.LOOP)
    depth = np.asarray(cv2.distanceTransform(solid, cv2.DIST_L2, 5), dtype=np.float32)
    thin = skeletonize(solid > 0)  # type: ignore[no-untyped-call]
    path = _longest_path(np.asarray(thin, dtype=bool))
    if path is None:
        return no_skeleton(FrameStatus.BLOB)
    curve, branch = path
    if branch > _BRANCH * len(curve) + float(depth.max()):
        return no_skeleton(FrameStatus.BRANCH)
    inside = float(np.percentile(fine[solid > 0], 75))
    tip = inside * float(np.clip(_THIN_TIP + 0.075 * (width - 2.0), _THIN_TIP, 0.5))
    heads: list[_WideEnd] = []
    line = _to_the_tips(
        curve, fine, threshold, solid, depth, heads, min(threshold, max(tip, noise_level))
    )
    if line is None:
        return no_skeleton(FrameStatus.BLOB)
    if grey and width < THIN_PX:
        line = _fitted_line(line, level, width, depth, step)
    if line is None:
        return no_skeleton(FrameStatus.BLOB)
    if grey and width >= _POINTED_WIDTH_PX:
        line = to_pointed_tips(line, fine, WORKING_WIDTH, step)
    return _in_segments(line, depth, step, origin_px, heads)


def _fitted_line(
    line: Floats, level: Level, width: float, depth: Level, step: float
) -> Floats | None:
    """Fit the line of a thin body to the grey levels; None if a very thin one has no fit."""
    uniform = float(depth.max()) < _UNIFORM * WORKING_WIDTH
    if not uniform and width >= _UNSURE_PX:
        return line
    fitted_line = fitted((line - _MARGIN + 0.5) / step - 0.5, level, width)
    if fitted_line is None:
        return None if width < _UNSURE_PX else line
    return (fitted_line[0] + 0.5) * step - 0.5 + _MARGIN


def _in_segments(
    line: Floats,
    depth: Level,
    step: float,
    origin_px: tuple[float, float],
    heads: Sequence[_WideEnd],
) -> Skeleton:
    """Skeleton along a line (n, 2) in the working picture, as wide as its wide ends there."""
    even = in_equal_chords(line, np.zeros(1))
    if even is None:
        return no_skeleton(FrameStatus.BLOB)
    radius = values_at(depth, even.points_px) / step
    for head in heads:
        within = np.hypot(*(even.points_px - head.place).T) < head.length
        radius[within] = np.maximum(radius[within], head.deep / step)
    points = (even.points_px - _MARGIN + 0.5) / step - 0.5 + np.asarray(origin_px)
    return Skeleton(points, radius, even.length_px / step, FrameStatus.GOOD)


def _width(mask: Bools) -> float | None:
    """Width of a long body from area and outline, px: ``A = L w``, ``U = 2 (L + w)``."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    outline = max(contours, key=len)
    half = 0.5 * cv2.arcLength(outline, closed=True) + 2.0  # the contour runs through pixel centres
    area = float(np.count_nonzero(mask))
    square = half * half - 4.0 * area
    if square <= 0.0 or area < 6.0:
        return None
    wide = 0.5 * (half - np.sqrt(square))
    return float(wide) if half > _LONG_WIDTHS * wide + wide else None


def resized(level: Level, scale: float) -> Level:
    """(h, w) picture, ``scale`` pixels a pixel."""
    if scale < 1.0:
        level = np.asarray(cv2.GaussianBlur(level, (0, 0), 0.4 / scale), dtype=np.float32)
    rows, columns = (max(1, int(np.ceil(side * scale))) for side in level.shape)
    off = 0.5 * scale - 0.5
    matrix = np.array([[scale, 0.0, off], [0.0, scale, off]])
    how = cv2.INTER_CUBIC if scale > 1.0 else cv2.INTER_LINEAR
    fine = cv2.warpAffine(
        level, matrix, (columns, rows), flags=how, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(fine, dtype=np.float32)


def _to_the_tips(
    chain: Floats,
    fine: Level,
    threshold: float,
    solid: Image,
    depth: Level,
    heads: list[_WideEnd],
    tip: float,
) -> Floats | None:
    """Smooth the chain of pixels, remove forks at its ends, extend it to the boundary.

    Wide ends are added to ``heads``.
    """
    line = gaussian_filter1d(chain, _SMOOTH, axis=0, mode="nearest")
    arc = arc_lengths(line)
    deep = values_at(depth, line)
    # within a radius of the end, the axis of a blunt body turns into a corner
    inner = np.flatnonzero((arc >= deep) & (arc[-1] - arc >= deep))
    if len(inner) < 4:
        return None
    forks = _wide_end(line, deep), _wide_end(line[::-1], deep[::-1])
    first = inner[0] if forks[0] is None else forks[0]
    last = inner[-1] if forks[1] is None else len(line) - 1 - forks[1]
    if last - first < 4:
        return None
    core = line[first : last + 1]
    for _ in range(_CENTRINGS):
        core = _centred_line(core, fine, threshold)
    reach = min(round(WORKING_WIDTH), len(core))
    ends = []
    for end, fork in ((core[::-1], forks[0]), (core, forks[1])):
        if fork is None:
            ends.append(_tip(end[-reach:], fine, tip))
        else:
            front = _to_the_front(end, float(deep.max()), solid)
            heads.append(_WideEnd(end[-1], float(values_at(depth, end[-1:])[0]), float(len(front))))
            ends.append(front)
    return np.vstack([ends[0][::-1], core, ends[1]])


def _wide_end(line: Floats, deep: Floats) -> int | None:
    """Where an axis (K, 2) enters one half of a wide first end; None if it does not."""
    near = deep[: round(_NEAR_END * len(line))]
    most = float(near.max(initial=0.0))
    if most < _WIDE_END * float(np.median(deep)):
        return None
    place = int(np.flatnonzero(near >= _AS_DEEP * most)[-1])
    if arc_lengths(line[: place + 1])[-1] > _SHORT_END * most:
        return None
    behind = min(place + max(2, round(1.5 * most)), len(line) - 1)
    ahead = line[place] - line[behind]
    every = max(1, min(place, round(0.5 * most)))
    directions = line[: place + 1 - every] - line[every : place + 1]
    straight = directions @ ahead / np.maximum(np.hypot(*directions.T) * np.hypot(*ahead), 1e-9)
    return place if straight.min() < _HOOK_COSINE else None


def _to_the_front(end: Floats, deep: float, solid: Image) -> Floats:
    """Points from the end of a line, between both halves of a wide end, to its front."""
    ahead = end[-1] - end[max(0, len(end) - 1 - round(1.5 * deep))]
    ahead = ahead / np.hypot(*ahead)
    y, x = np.nonzero(solid)
    away = np.column_stack([x, y]) - end[-1]
    along = away @ ahead
    near = (along > 0.0) & (np.hypot(*away.T) < _REACH * deep)
    if not near.any():
        return np.empty((0, 2))
    ahead = _bounded_direction(away[near].mean(axis=0), ahead)  # the middle between both halves
    front = float(np.percentile(away[near] @ ahead, _FRONT))
    return np.asarray(end[-1] + np.arange(1.0, front)[:, None] * ahead)


def _centred_line(line: Floats, fine: Level, threshold: float) -> Floats:
    """Move each point to the middle between both sides.

    Thinning is off by up to a pixel, and smoothing shortens bends.
    """
    _, side = along_and_side(line)
    out = np.arange(0.0, WORKING_WIDTH, 0.5)
    reach = []
    for sign in (1.0, -1.0):
        ray = line[:, None] + sign * out[:, None] * side[:, None]
        level = values_at(fine, ray)
        below = level < threshold
        last = np.argmax(below, axis=1)
        row = np.arange(len(line))
        high, low = level[row, np.maximum(last - 1, 0)], level[row, last]
        part = np.clip((high - threshold) / np.maximum(high - low, 1e-6), 0.0, 1.0)
        reach.append(np.where(last > 0, out[last] - 0.5 + 0.5 * part, np.nan))
    off = 0.5 * (reach[0] - reach[1])
    central = np.flatnonzero(np.abs(off) < 0.25 * WORKING_WIDTH)
    if not central.size:
        return line
    off = np.interp(np.arange(len(line)), central, off[central])
    return np.asarray(line + gaussian_filter1d(off, _SMOOTH, mode="nearest")[:, None] * side)


def _tip(end: Floats, fine: Level, threshold: float) -> Floats:
    """Extend ``end`` (K, 2) along the ridge to the end of the body; return the new points."""
    ahead = end[-1] - end[0]
    first = ahead = ahead / np.hypot(*ahead)
    across = np.linspace(-0.5, 0.5, 15) * WORKING_WIDTH
    tip = end[-1]
    tips = []
    last = threshold
    for _ in range(round(4.0 * WORKING_WIDTH)):
        there = tip + ahead
        side = np.array([-ahead[1], ahead[0]])
        level = values_at(fine, np.vstack([there, there + across[:, None] * side]))
        if level[0] <= threshold:
            part = (last - threshold) / max(last - level[0], 1e-6)
            tips.append(tip + float(np.clip(part, 0.0, 1.0)) * ahead)
            break
        last = float(level[0])
        weight = np.maximum(level[1:] - threshold, 0.0)
        off = float((weight * across).sum() / max(float(weight.sum()), 1e-9))
        turned = ahead + off / WORKING_WIDTH * side
        ahead = _bounded_direction(turned, first)
        tip = there + 0.5 * off * side
        tips.append(tip)
    return np.asarray(tips)


def _bounded_direction(turned: Floats, first: Floats) -> Floats:
    """Unit vector of a direction (2,), at most 37 degrees from the unit vector ``first``."""
    side = np.array([-first[1], first[0]])
    slope = float(turned @ side) / max(float(turned @ first), 1e-9)
    slope = float(np.clip(slope, -_MOST_TURN, _MOST_TURN))
    return np.asarray((first + slope * side) / np.hypot(1.0, slope))


def _largest_part(mask: Bools) -> Image | None:
    """Largest part (h, w), 1 inside; None if the mask is empty."""
    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    if count < 2:
        return None
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return np.asarray(label == best, dtype=np.uint8)


def _filled_holes(solid: Image, hole_px: float) -> tuple[Image, bool]:
    """Fill holes; also return whether one exceeds ``hole_px``, so that the body encloses it."""
    count, label, stats, _ = cv2.connectedComponentsWithStats(1 - solid, connectivity=8)
    outside = label[0, 0]
    holes = [stats[k, cv2.CC_STAT_AREA] for k in range(1, count) if k != outside]
    looped = max(holes, default=0) > hole_px
    return (label != outside).astype(np.uint8), bool(looped)


def _longest_path(thin: Bools) -> tuple[Floats, float] | None:
    """Longest path (K, 2) x, y between two ends, and how far other parts lie from it."""
    rows, columns = np.nonzero(thin)
    if len(rows) < 3:
        return None
    wide = thin.shape[1]
    place = np.full(thin.size, -1)
    flat = rows * wide + columns
    place[flat] = np.arange(len(flat))

    def paths_from(start: Sequence[int]) -> tuple[Floats, Ints]:
        length = np.full(len(flat), -1.0)
        before = np.full(len(flat), -1)
        walk_line(place, flat, wide, np.asarray(start), length, before)
        return length, before

    lengths, _ = paths_from([0])
    far, before = paths_from([int(np.argmax(lengths))])
    chain = [int(np.argmax(far))]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    away, _ = paths_from(chain)
    return np.column_stack([columns[chain], rows[chain]]).astype(float), float(away.max())


_INTS = "int64[::1]"


@compiled(f"void({_INTS}, {_INTS}, int64, {_INTS}, float64[::1], {_INTS})")
def walk_line(
    place: Ints, flat: Ints, wide: int, start: Ints, length: Floats, before: Ints
) -> None:
    """Walk over the pixels of a thin line, breadth first.

    Args:
        place: (H W,) index of each pixel on the line, -1 elsewhere; the image's rim must be -1.
        flat: (N,) flat position of each pixel of the line.
        wide: W.
        start: (S,) indices of the first pixels.
        length: (N,) px, in: -1; out: path length to each pixel.
        before: (N,) in: -1; out: the previous pixel.

    """
    front = np.empty(len(flat), np.int64)
    count = len(start)
    for k in range(count):
        front[k] = start[k]
        length[start[k]] = 0.0
    slanted = 2.0**0.5
    sides = (1, -1, wide, -wide, wide + 1, wide - 1, -wide + 1, -wide - 1)
    index = 0
    while index < count:
        node = front[index]
        index += 1
        for side in range(8):
            other = place[flat[node] + sides[side]]
            if other >= 0 and length[other] < 0.0:
                length[other] = length[node] + (1.0 if side < 4 else slanted)
                before[other] = node
                front[count] = other
                count += 1
