"""Morphable model: a local model and its destination at the next position ([KP] 3.4)."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, cells, project, sampled
from snakewalk.controller.mapping.mosaic.poisson import continued
from snakewalk.controller.mapping.mosaic.relative_pose import RelativePose
from snakewalk.controller.mapping.mosaic.scale_flow import LEAST_CORRELATION, ScaleFlow

LARGEST_GAP = 0.12
"""Relative difference of depth between a point and its counterpart (ours); more is occlusion."""
_LEAST_ISLAND_PX = 40


@dataclass(frozen=True)
class MorphableModel:
    """Model of a position with maps of its destination, in the position's axes."""

    first: LocalModel
    second: LocalModel
    pose: RelativePose
    common: Bools
    """(H, W) Psi: pixels of the valid region with a counterpart in the second model."""
    counterpart_px: Floats
    """(H, W, 2) ``u(p)`` in the second picture; NaN outside of Psi."""
    destination_m: Floats
    """(H, W, 3) ``X_dst, Y_dst, Z_dst``; NaN outside of the valid region."""

    def points_m(self, share: float) -> Floats:
        """(H, W, 3) vertices by Eq. 1: ``(1 - m) X_k + m X_dst``."""
        return (1.0 - share) * self.first.points_m + share * self.destination_m

    @cached_property
    def cells(self) -> Bools:
        """(H - 1, W - 1) cells that belong to one surface here and at the destination."""
        return self.first.cells & cells(self.destination_m)


def dense_flow(
    first: LocalModel, second: LocalModel, pose: RelativePose, flow: ScaleFlow
) -> Floats:
    """(H, W, 2) counterparts of all pixels in the second picture, or NaN.

    Between labelled pixels the difference from the reprojection is interpolated.
    """
    pixel = np.stack(np.meshgrid(*(np.arange(n) for n in first.valid.shape[::-1])), axis=-1)
    projected_px = project(second.camera, pose.moved(first.points_m))
    grid = np.ix_(flow.rows, flow.columns)
    off = flow.flow_px + pixel[grid] - projected_px[grid]
    with np.errstate(invalid="ignore"):
        good = np.isfinite(off).all(axis=-1) & (flow.correlation >= LEAST_CORRELATION)
    weight = good.astype(np.float32)
    offsets_px = np.where(good[..., None], off, 0.0).astype(np.float32)
    size = 3
    smooth = cv2.blur(weight, (size, size))
    mean = cv2.blur(offsets_px, (size, size)) / np.maximum(smooth, 1e-6)[..., None]
    step = flow.rows[1] - flow.rows[0]
    at_row = ((np.arange(projected_px.shape[0]) - flow.rows[0]) / step).astype(np.float32)
    at_column = ((np.arange(projected_px.shape[1]) - flow.columns[0]) / step).astype(np.float32)
    map_x, map_y = np.meshgrid(at_column, at_row)
    spread = [
        np.asarray(
            cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        )
        for image in (mean * weight[..., None], weight)
    ]
    is_known = spread[1] > 0.5
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(
            is_known[..., None], projected_px + spread[0] / spread[1][..., None], np.nan
        )


def morphable(
    first: LocalModel, second: LocalModel, pose: RelativePose, flow: ScaleFlow
) -> MorphableModel:
    """Fill the destination maps: Eq. 3 at pixels with a counterpart, Eq. 5 elsewhere."""
    places = dense_flow(first, second, pose, flow)
    met = pose.back(sampled(second.points_m.astype(np.float32), places).astype(float))
    with np.errstate(invalid="ignore"):
        gap = np.linalg.norm(met - first.points_m, axis=-1) / first.points_m[..., 2]
        common = first.valid & (gap <= LARGEST_GAP)
    common = _without_islands(common)
    destination = continued(met, common, first.points_m)
    places = np.where(common[..., None], places, np.nan)
    return MorphableModel(first, second, pose, common, places, destination)


def _without_islands(mask: Bools) -> Bools:
    _, label, facts, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    large = facts[:, cv2.CC_STAT_AREA] >= _LEAST_ISLAND_PX
    return np.asarray(mask & large[label])
