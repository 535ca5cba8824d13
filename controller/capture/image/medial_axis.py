"""The medial axis of a silhouette as one ordered curve from tip to tip ([PT] 2.3).

Thinned at a fixed working width, so that the cost does not depend on the size of the body; side
branches pruned by taking the longest way between two ends; then extended to both tips.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.morphology import skeletonize

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.frame_status import FrameStatus
from snakewalk.controller.capture.image.equipartition import NoEquipartitionError, equipartition
from snakewalk.controller.capture.image.ridge import WORKING_WIDTH, sample, to_the_tips
from snakewalk.controller.capture.image.thinning import filled, largest, longest_way
from snakewalk.controller.capture.small_body.thin_body_fit import THIN_PX, fitted

Level = NDArray[np.float32]
SEGMENTS = 100
_MARGIN = 3
_LARGEST_PX = 8000  # side of the enlarged cut-out
_HOLE = 0.35  # a larger hole, in squares of the width, is a loop of the body
_THIN_TIP = 0.2  # of the contrast, where a body two pixels wide ends: blur takes its tips away
_UNSURE_PX = 4.5  # a thinner body's line is used only where its blurred picture fits
_LONG = 2.5  # widths: what is shorter is no long body
_BRANCH = 0.14  # of the length: a longer side branch is a part of the body


@dataclass(frozen=True, slots=True)
class Skeleton:
    """A body in one image; lengths in pixels of that image, x to the right and y downwards."""

    points_px: Floats
    """(101, 2) x, y at 100 equal chords from tip to tip; NaN where there is none. Which end is the
    head is for ``identity`` to say. A pixel's centre has whole coordinates."""
    radius_px: Floats
    """(101,) distance to the boundary."""
    length_px: float
    """Sum of the chords; NaN where there is no skeleton."""
    status: FrameStatus

    def reversed(self) -> "Skeleton":
        """The same body from its other end."""
        return Skeleton(
            self.points_px[::-1].copy(), self.radius_px[::-1].copy(), self.length_px, self.status
        )


def no_skeleton(status: FrameStatus) -> Skeleton:
    """Stand-in for the skeleton of a frame that cannot be used: all NaN."""
    nan = np.full((SEGMENTS + 1, 3), np.nan)
    return Skeleton(nan[:, :2].copy(), nan[:, 2].copy(), float("nan"), status)


def skeleton_of(mask: NDArray[np.bool_]) -> Skeleton:
    """Skeleton of a body given as a mask (H, W) of one component, holes of the image filled or not.

    Never raises on a mask: an empty, round, looped or branching one has a status other than
    ``GOOD``, and NaN for points. The order of the ends is arbitrary.
    """
    shape = np.ascontiguousarray(mask, dtype=np.uint8)
    rows, columns = np.flatnonzero(shape.any(axis=1)), np.flatnonzero(shape.any(axis=0))
    if not rows.size:
        return no_skeleton(FrameStatus.NOTHING)
    top, left = int(rows[0]), int(columns[0])
    body = shape[top : rows[-1] + 1, left : columns[-1] + 1]
    level = cv2.copyMakeBorder(body, *(_MARGIN,) * 4, cv2.BORDER_CONSTANT, value=0)
    return skeleton_of_level(
        level.astype(np.float32),
        0.5,
        (float(left - _MARGIN), float(top - _MARGIN)),
        grey=False,
    )


def skeleton_of_level(
    level: Level,
    threshold: float,
    origin_px: tuple[float, float] = (0.0, 0.0),
    least: float = 0.0,
    *,
    grey: bool = True,
) -> Skeleton:
    """Skeleton of the largest part of ``level`` (h, w) above ``threshold``: finer than of a mask.

    Args:
        level: contrast of one body against nothing, as a cut-out of an image.
        threshold: the contrast at the body's boundary.
        origin_px: x, y of the cut-out's first pixel in the image.
        least: contrast that noise alone reaches; tips are not looked for below it.
        grey: whether ``level`` falls off at the boundary as blur makes it; a mask does not.

    """
    width = _width(level > threshold)
    if width is None:
        return no_skeleton(FrameStatus.BLOB)
    step = min(WORKING_WIDTH / width, _LARGEST_PX / max(level.shape))
    fine = _rescaled(level, step)
    solid = largest(fine > threshold)
    if solid is None:
        return no_skeleton(FrameStatus.NOTHING)
    solid, looped = filled(solid, _HOLE * WORKING_WIDTH**2)
    if looped:
        return no_skeleton(FrameStatus.LOOP)
    depth = np.asarray(cv2.distanceTransform(solid, cv2.DIST_L2, 5), dtype=np.float32)
    thin = skeletonize(solid > 0)  # type: ignore[no-untyped-call]
    way = longest_way(np.asarray(thin, dtype=bool))
    if way is None:
        return no_skeleton(FrameStatus.BLOB)
    curve, branch = way
    if branch > _BRANCH * len(curve) + float(depth.max()):
        return no_skeleton(FrameStatus.BRANCH)
    inside = float(np.percentile(fine[solid > 0], 75))
    tip = inside * float(np.clip(_THIN_TIP + 0.075 * (width - 2.0), _THIN_TIP, 0.5))
    line = to_the_tips(curve, fine, threshold, depth, min(threshold, max(tip, least)))
    if line is None:
        return no_skeleton(FrameStatus.BLOB)
    if width < THIN_PX and grey:
        found = fitted((line - _MARGIN + 0.5) / step - 0.5, level, width)
        if found is None and width < _UNSURE_PX:
            return no_skeleton(FrameStatus.BLOB)
        if found is not None:
            line = (found[0] + 0.5) * step - 0.5 + _MARGIN
    try:
        even = equipartition(line, SEGMENTS)
    except (NoEquipartitionError, ValueError):
        return no_skeleton(FrameStatus.BLOB)
    radius = sample(depth, even.points) / step
    points = (even.points - _MARGIN + 0.5) / step - 0.5 + np.asarray(origin_px)
    return Skeleton(points, radius, even.chord * SEGMENTS / step, FrameStatus.GOOD)


def _width(mask: NDArray[np.bool_]) -> float | None:
    """Width of a long body from area and outline, px: ``A = L w``, ``U = 2 (L + w)``."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    outline = max(contours, key=len)
    half = 0.5 * cv2.arcLength(outline, closed=True) + 2.0  # the chain runs through pixel centres
    area = float(np.count_nonzero(mask))
    square = half * half - 4.0 * area
    if square <= 0.0 or area < 6.0:
        return None
    wide = 0.5 * (half - np.sqrt(square))
    return float(wide) if half > _LONG * wide + wide else None


def _rescaled(level: Level, scale: float) -> Level:
    if scale < 1.0:
        level = np.asarray(cv2.GaussianBlur(level, (0, 0), 0.4 / scale), dtype=np.float32)
    rows, columns = (max(1, round(side * scale)) for side in level.shape)
    how = cv2.INTER_CUBIC if scale > 1.0 else cv2.INTER_LINEAR
    matrix = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]]) * scale - [[0, 0, 0.5], [0, 0, 0.5]]
    fine = cv2.warpAffine(
        level, matrix, (columns, rows), flags=how, borderMode=cv2.BORDER_REPLICATE
    )
    fine = cv2.copyMakeBorder(fine, *(_MARGIN,) * 4, cv2.BORDER_CONSTANT, value=0)
    return np.asarray(cv2.GaussianBlur(fine, (0, 0), 1.0), dtype=np.float32)
