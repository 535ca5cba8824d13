"""First posture of a search: the silhouette's skeleton, with the head at either end.

[TH] 3.3.1 derives the head from the displacement between the first two frames. This fails for a
fish at rest or backward, so both orientations are matched, and the better one is kept.
"""

import cv2
import numpy as np
from scipy.sparse.csgraph import breadth_first_order
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.controller.animals.fish.model import FishModel
from snakewalk.controller.animals.fish.postures import midline_angles
from snakewalk.controller.kinematics.arc_length import arc_lengths

_DIAGONAL = 1.5
"""A pixel's eight neighbours are closer than this."""


def rough_midline(mask: Bools) -> Floats | None:
    """Longest path through the skeleton of a mask: (P, 2), x right, y up, ends at the body's rim.

    None where the mask holds no body of 8 pixels length. The mask is reduced to 120 pixels first.
    """
    rows, columns = np.nonzero(mask)
    if len(rows) < 8:
        return None
    top = int(rows.min())
    left = int(columns.min())
    part = mask[top : rows.max() + 1, left : columns.max() + 1].astype(np.uint8) * 255
    scale = min(1.0, 120.0 / max(part.shape))
    shape = (max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale)))
    small = np.pad(cv2.resize(part, shape, interpolation=cv2.INTER_AREA) > 127, 2)
    bones = np.asarray(
        skeletonize(cv2.medianBlur(small.astype(np.uint8), 3) > 0),  # type: ignore[no-untyped-call]
        dtype=np.bool_,
    )
    path = _longest_path(bones)
    if path is None or len(path) < 8:
        return None
    depth = cv2.distanceTransform(small.astype(np.uint8), cv2.DIST_L2, 5)
    points = np.column_stack([path[:, 1], -path[:, 0]]).astype(float)
    soft = 3
    smooth = np.stack(
        [points[max(0, k - soft) : k + soft + 1].mean(axis=0) for k in range(len(points))]
    )
    ends = [
        _excess(smooth, float(depth[tuple(path[0])])),
        _excess(smooth[::-1], float(depth[tuple(path[-1])])),
    ]
    joined = np.concatenate([ends[0][None], smooth[::4], smooth[-1:], ends[1][None]])
    return np.asarray((joined + np.array([-1.5, 1.5])) / scale + np.array([left - 0.5, -top + 0.5]))


def midline_starts(model: FishModel, midline: Floats) -> list[Floats]:
    """Parameters (3 + J,) of a midline, base x, y, head, angles, with the head at either end."""
    midlines = []
    for points in (midline, midline[::-1]):
        head, angles = midline_angles(points, model.joints_at)
        chord = arc_lengths(points)
        place = model.joints_at[0] * chord[-1]
        base = [np.interp(place, chord, points[:, k]) for k in range(2)]
        midlines.append(np.array([*base, head, *angles]))
    return midlines


def _excess(points: Floats, reach: float) -> Floats:
    step = points[0] - points[min(4, len(points) - 1)]
    return np.asarray(points[0] + step / max(float(np.hypot(*step)), 1e-9) * reach)


def _longest_path(bones: Bools) -> Ints | None:
    """Pixels (P, 2), row and column, of the longest shortest path in any part of the skeleton."""
    pixels = np.argwhere(bones)
    tree = cKDTree(pixels)
    neighbours = tree.sparse_distance_matrix(tree, _DIAGONAL, output_type="coo_matrix").tocsr()
    best: list[int] = []
    others = set(range(len(pixels)))
    while others:
        far, _ = breadth_first_order(neighbours, min(others))
        reached, before = breadth_first_order(neighbours, far[-1])
        path = [int(reached[-1])]
        while path[-1] != far[-1]:
            path.append(int(before[path[-1]]))
        best = max(best, path, key=len)
        others -= set(reached.tolist())
    return pixels[best] if best else None
