"""The body of a film, fitted to a silhouette in which it may lie on itself.

A medial axis needs two free sides along the whole body. The union of the discs of a body of known
length and widths does not: its distances to the boundary are compared with those of the silhouette.
The method is damped least squares over the bends and the place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Bytes, Floats, Ints
from snakewalk.controller.capture.small_body.crop import bends_of
from snakewalk.controller.capture.small_body.ribbon import headings, summed
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, resized
from snakewalk.controller.images.silhouette import Silhouette
from snakewalk.controller.images.thin_body_fit import spline_basis
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.drivers.compiling import compiled

COIL_BENDS = 14
"""Coefficients of the tangent angle: four more than without coils."""
PARAMETERS = 3 + COIL_BENDS
"""Parameters of a frame: x, y of the middle of the body against that of the silhouette, log of the
length over the usual one, bends."""
WIDTH_PX = 8.0
"""Greatest width of the body during the fit, working px."""
_DISCS = 60
_MARGIN_PX = 14  # working px around a silhouette
_THRESHOLD_GREY = 127.5  # of a packed silhouette: its boundary
_HOLE = 0.1  # squares of the width: a smaller hole is a light spot
_COARSE_SPOTS = (1.5, 0.3)
_FINE_SPOTS = (0.4, 0.2)  # of the width: largest distance outside and inside
_ROUNDS = 12
_LEAST_GAIN = 1e-3  # of the cost
_COMMON_PIXELS = 9.0  # neighbouring pixels with nearly the same residual
_LENGTH = 0.015  # prior standard deviation of the log of a frame's length
_STIFF = 2.0  # rad, of second differences of the bends
_LEAST_GAP_PX = 1.25  # working px on both sides of the boundary: the edge
UNCLEAR_STATUSES = {
    FrameStatus.BLOB,
    FrameStatus.LARGER,
    FrameStatus.PART,
    FrameStatus.GHOST,
}  # or else
COILS = {FrameStatus.LOOP, FrameStatus.BRANCH, FrameStatus.SHORT, *UNCLEAR_STATUSES}
"""Statuses that a coil may have."""


@dataclass(frozen=True, slots=True)
class Outline:
    """A silhouette, reduced so that every frame of a film can keep one."""

    packed: Bytes
    """A PNG of the mask."""
    origin_px: tuple[float, float]
    scale: float
    """Pixels of the mask a pixel."""

    @classmethod
    def of(cls, silhouette: Silhouette, width_px: float) -> "Outline":
        """Keep a silhouette; ``width_px`` of the body, 0 if unknown."""
        scale = 1.0 if width_px == 0.0 else min(1.0, 2.0 * WIDTH_PX / width_px)
        level = silhouette.level
        if scale < 1.0:
            level = resized(level, scale)
        grey = np.clip(np.rint(level * (_THRESHOLD_GREY / silhouette.threshold)), 0.0, 255.0)
        packed = cv2.imencode(".png", grey.astype(np.uint8))[1]
        return cls(np.asarray(packed, dtype=np.uint8), silhouette.origin_px, scale)


@dataclass(frozen=True, slots=True)
class Shape:
    """A silhouette on the working grid, as distances from its boundary."""

    depth: Floats
    """(h, w) working px: above 0 inside, below outside."""
    middle: Floats
    """(2,) x, y of the middle of the silhouette on the working grid."""
    first_px: Floats
    """(2,) x, y of the first pixel's centre in the image."""
    scale: float
    """Working pixels a pixel of the image."""

    @classmethod
    def of(cls, outline: Outline, scale: float) -> "Shape":
        """Unpack a silhouette at ``scale`` working pixels a pixel."""
        level = np.asarray(cv2.imdecode(outline.packed, cv2.IMREAD_GRAYSCALE), dtype=np.float32)
        fine = np.pad(resized(level, scale / outline.scale), _MARGIN_PX)
        solid = (fine > _THRESHOLD_GREY).astype(np.uint8)
        count, label, stats, _ = cv2.connectedComponentsWithStats(1 - solid, connectivity=8)
        for k in range(1, count):
            if k != label[0, 0] and stats[k, cv2.CC_STAT_AREA] < _HOLE * WIDTH_PX**2:
                solid[label == k] = 1
        inside = cv2.distanceTransform(solid, cv2.DIST_L2, 5)
        outside = cv2.distanceTransform(1 - solid, cv2.DIST_L2, 5)
        depth = np.where(solid > 0, inside - 0.5, 0.5 - outside).astype(float)
        y, x = np.nonzero(solid)
        first = (0.5 - _MARGIN_PX) / scale - 0.5 + np.asarray(outline.origin_px)
        return cls(depth, np.array([x.mean(), y.mean()]), first, scale)

    def to_px(self, line: Floats) -> Floats:
        """Places in the image, of places (P, 2) on the working grid."""
        return line / self.scale + self.first_px

    def from_px(self, line_px: Floats) -> Floats:
        """Places on the working grid, of places (P, 2) in the image."""
        return (line_px - self.first_px) * self.scale


@dataclass(frozen=True, slots=True)
class CoilBody:
    """Properties of a film's body from its good frames, on the working grid."""

    length: float
    half_width: Floats
    """(_DISCS,) half widths along the body."""
    scale: float
    """Working pixels a pixel."""

    @classmethod
    def of(cls, skeletons: Sequence[Skeleton]) -> "CoilBody":
        """Median length and widths of good skeletons, the same end first in all."""
        radius = np.median(np.stack([skeleton.radius_px for skeleton in skeletons]), axis=0)
        scale = WIDTH_PX / (2.0 * float(np.percentile(radius, 95.0)))
        length = float(np.median([skeleton.length_px for skeleton in skeletons]))
        place = np.linspace(0.0, SEGMENTS, _DISCS)
        wide = np.interp(place, np.arange(SEGMENTS + 1), radius)
        return cls(length * scale, wide * scale, scale)

    def line(self, values: Floats, shape: Shape, pieces: int = _DISCS - 1) -> Floats:
        """(pieces + 1, 2) the body's middle line on the grid of ``shape``, head first."""
        return curve(values, self.length, shape.middle, pieces)

    def values_of(self, skeleton: Skeleton, shape: Shape) -> Floats:
        """(PARAMETERS,) of a body whose skeleton is known."""
        line = shape.from_px(skeleton.points_px)
        bends = bends_of(line, COIL_BENDS)
        off = line.mean(axis=0) - shape.middle
        size = np.log(skeleton.length_px * self.scale / self.length)
        return np.concatenate([off, [size], bends])


_BASIS = spline_basis((np.arange(_DISCS - 1) + 0.5) / (_DISCS - 1), COIL_BENDS)


def curve(values: Floats, length: float, middle: Floats, pieces: int = _DISCS - 1) -> Floats:
    """(pieces + 1, 2) the line of a frame's values; ``middle`` (2,) of its silhouette."""
    places = (np.arange(pieces) + 0.5) / pieces
    basis = _BASIS if pieces == len(_BASIS) else spline_basis(places, COIL_BENDS)
    angle = basis @ values[3:]
    line = summed(headings(angle)[0] * (length * float(np.exp(values[2])) / pieces))
    return np.asarray(line - line.mean(axis=0) + middle + values[:2])


def line_slopes(values: Floats, length: float) -> Floats:
    """(_DISCS, 2, PARAMETERS) derivatives of the discs' places by the values of a frame."""
    angle = _BASIS @ values[3:]
    size = length * float(np.exp(values[2])) / len(angle)
    ahead, aside = headings(angle)
    turned = aside[:, :, None] * _BASIS[:, None, :]
    moved = summed(np.concatenate([ahead[:, :, None], turned], axis=2) * size)
    moved = moved - moved.mean(axis=0)
    place = np.broadcast_to(np.eye(2), (_DISCS, 2, 2))
    return np.concatenate([place, moved], axis=2)


@dataclass(frozen=True, slots=True)
class Normal:
    """Linearised least squares of one frame: ``information d = push``, and its cost."""

    information: Floats
    push: Floats
    cost: float
    squares: float
    """Mean square of the residual, working px squared."""


@compiled("void(float64[:, ::1], float64[::1], float64, float64[:, ::1], int64[:, ::1])")
def _draw_discs(
    line: Floats, half_width: Floats, reach: float, depth: Floats, nearest: Ints
) -> None:
    """Write the greatest depth in any disc (h, w), and its disc, up to ``reach`` outside."""
    rows, columns = depth.shape
    for k in range(len(line)):
        x = line[k, 0]
        y = line[k, 1]
        wide = half_width[k]
        far = wide + reach
        top, bottom = max(0, int(np.ceil(y - far))), min(rows - 1, int(np.floor(y + far)))
        left, right = max(0, int(np.ceil(x - far))), min(columns - 1, int(np.floor(x + far)))
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                depth_here = wide - np.sqrt((column - x) ** 2 + (row - y) ** 2)
                if depth_here > depth[row, column]:
                    depth[row, column] = depth_here
                    nearest[row, column] = k


def body_depth(line: Floats, half_width: Floats, shape: Shape, reach: float) -> tuple[Floats, Ints]:
    """(h, w) distances from the boundary of the union of discs, and each pixel's disc.

    Beyond ``reach`` they are minus ``reach``.
    """
    depth = np.full(shape.depth.shape, -reach)
    nearest = np.zeros(shape.depth.shape, dtype=np.int64)
    _draw_discs(np.ascontiguousarray(line), half_width, reach, depth, nearest)
    return depth, nearest


def normal_of(
    values: Floats, body: CoilBody, shape: Shape, squares: float, *, coarse: bool = False
) -> Normal:
    """Compare a body with a silhouette.

    Args:
        values: (PARAMETERS,)
        body: of the film.
        shape: the silhouette.
        squares: usual mean square of the residual of a good frame.
        coarse: boundaries far apart count by their distance.

    """
    line = body.line(values, shape)
    low, high = (v * WIDTH_PX for v in (_COARSE_SPOTS if coarse else _FINE_SPOTS))
    depth, nearest = body_depth(line, body.half_width, shape, low)
    clipped = np.clip(shape.depth, -low, high)
    rest = clipped - np.clip(depth, -low, high)
    near = (shape.depth > -low) | (depth > -low)
    y, x = np.nonzero((depth > -low) & (depth < high))
    disc = nearest[y, x]
    away = np.column_stack([x, y]) - line[disc]
    away /= np.maximum(np.hypot(*away.T), 0.5)[:, None]
    slopes = line_slopes(values, body.length)[disc]
    jacobian = (away[:, :, None] * slopes).sum(axis=1)
    heavy = 1.0 / (squares * _COMMON_PIXELS)
    mean = float((rest[near] ** 2).mean())
    prior, target = _own_prior(values)
    information = heavy * (jacobian.T @ jacobian) + prior.T @ prior
    push = heavy * (jacobian.T @ rest[y, x]) + prior.T @ target
    cost = heavy * float((rest[near] ** 2).sum()) + float(target @ target)
    return Normal(information, push, cost, mean)


def _own_prior(values: Floats) -> tuple[Floats, Floats]:
    """Rows of the prior of any frame, and their residuals."""
    rows = np.zeros((COIL_BENDS - 1, PARAMETERS))
    rows[0, 2] = 1.0 / _LENGTH
    rows[1:, 3:] = np.diff(np.eye(COIL_BENDS), 2, axis=0) / _STIFF
    return rows, -rows @ values


def fit_coil(
    start: Floats,
    body: CoilBody,
    shape: Shape,
    squares: float,
    prior: tuple[Floats, Floats] | None = None,
    *,
    coarse: bool = True,
) -> tuple[Floats, Normal]:
    """Fit one frame from ``start`` (PARAMETERS,); damped least squares.

    ``prior`` is the prediction for the frame: expected values and their information.
    """
    kept = start
    normal = normal_of(start, body, shape, squares, coarse=coarse)
    for far in (True, False) if coarse else (False,):
        damp = 1e-2
        best = np.inf
        values = kept
        for _ in range(_ROUNDS):
            trial = normal_of(values, body, shape, squares, coarse=far)
            cost = trial.cost
            if prior is not None:
                off = prior[0] - values
                cost += float(off @ prior[1] @ off)
            if cost < best:
                done = best - cost < _LEAST_GAIN * cost
                best = cost
                kept = values
                normal = trial
                damp = 0.3 * damp
                if done:
                    break
            else:
                damp *= 8.0
            information = normal.information
            push = normal.push
            if prior is not None:
                information = information + prior[1]
                push = push + prior[1] @ (prior[0] - kept)
            values = kept + np.linalg.solve(
                information + damp * np.diag(np.diag(information)), push
            )
    return kept, normal


def left_over(values: Floats, body: CoilBody, shape: Shape) -> float:
    """Area that only the body or only the silhouette covers, beyond the edges, of the body's."""
    line = body.line(values, shape)
    depth, _ = body_depth(line, body.half_width, shape, 2.0 * _LEAST_GAP_PX)
    alone = (depth > _LEAST_GAP_PX) & (shape.depth < -_LEAST_GAP_PX)
    bare = (depth < -_LEAST_GAP_PX) & (shape.depth > _LEAST_GAP_PX)
    area = 2.0 * float(body.half_width.mean()) * body.length
    return float(np.count_nonzero(alone | bare)) / area
