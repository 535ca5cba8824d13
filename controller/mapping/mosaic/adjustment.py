"""Motions between positions that agree best with all matches of a route (ours).

A match is a pixel of one model and its place in another picture. Both models measured its depth.
The adjustment compares place and disparity in the second picture with those that the motions
predict, each weighted by its expected error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import coo_array, csr_array
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, moved, project, sampled
from snakewalk.controller.mapping.mosaic.scale_matches import ScaleMatches
from snakewalk.controller.mapping.stereo_ground import DISPARITY_ERROR_PX

_MATCH_ERROR_PX = 0.3
"""Expected error of a matched place, per unit of its scale (ours)."""
_OUTLIER = 4.0
"""Weighted error of a match that does not count, if it is three times the median (ours)."""
_ROUNDS = 4


@dataclass(frozen=True, slots=True)
class Sightings:
    """Matches from one position to a later one."""

    first: int
    second: int
    points_m: Floats
    """(n, 3) points in the axes of the first position."""
    seen_px: Floats
    """(n, 3) column, row and disparity in the second picture; the disparity may be NaN."""
    scale: Floats
    """(n,)"""
    cameras: tuple[LocalModel, LocalModel]

    @classmethod
    def of_matches(
        cls, numbers: tuple[int, int], models: tuple[LocalModel, LocalModel], matches: ScaleMatches
    ) -> "Sightings":
        """Look up the points and the disparities of matches."""
        first, second = models
        column, row = np.rint(matches.first_px).astype(int).T
        depth_m = sampled(
            second.points_m[..., 2].astype(np.float32), matches.second_px[:, None]
        ).ravel()
        disparity_px = second.camera[0, 0] * second.baseline_m / depth_m
        seen_px = np.column_stack([matches.second_px, disparity_px])
        return cls(*numbers, first.points_m[row, column], seen_px, matches.scale, models)

    def predicted_px(self, points_m: Floats) -> Floats:
        """(n, 3) column, row and disparity of points in the axes of the second position."""
        second = self.cameras[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            disparity_px = second.camera[0, 0] * second.baseline_m / points_m[:, 2]
        return np.column_stack([project(second.camera, points_m), disparity_px])

    def weights(self, motion: Floats) -> Floats:
        """(n, 3, 3) square roots of the inverse covariances, for a motion (3, 4) to the second.

        The disparity error of the first position moves a point along its ray.
        """
        first = self.cameras[0]
        moved_m = moved(self.points_m, motion)
        disparity_px = first.camera[0, 0] * first.baseline_m / self.points_m[:, 2]
        change = -self.points_m @ motion[:, :3].T * (0.01 / disparity_px)[:, None]
        along = (self.predicted_px(moved_m + change) - self.predicted_px(moved_m)) / 0.01
        along = np.nan_to_num(along * DISPARITY_ERROR_PX, nan=0.0, posinf=0.0, neginf=0.0)
        size_px = np.column_stack(
            [*2 * [_MATCH_ERROR_PX * self.scale], np.full(len(along), DISPARITY_ERROR_PX)]
        )
        covariance = np.einsum("ni,nj->nij", along, along)
        covariance[:, [0, 1, 2], [0, 1, 2]] += size_px**2
        return np.linalg.inv(np.linalg.cholesky(covariance))


@dataclass(frozen=True, slots=True)
class Adjusted:
    """Motions, and what they leave unexplained."""

    motions: Floats
    """(m, 3, 4) from each position's axes to those of the next one."""
    place_sd_m: Floats
    """(m,) standard deviations (root of the summed variances) of each next position's place."""
    angle_sd_rad: Floats
    """(m,) those of its axes."""
    agrees: tuple[Bools, ...]
    """For each group of sightings (n,): matches that agree with the motions."""


def adjusted(groups: Sequence[Sightings], motions: Floats) -> Adjusted:
    """Minimise the weighted errors of all sightings over the motions (m, 3, 4).

    Matches with an error above four standard deviations do not count. Standard deviations are
    increased if the rest has larger errors than expected. Each motion needs twelve matches.
    """
    count = len(motions)
    values = np.concatenate([_values(motion) for motion in motions])
    for _ in range(_ROUNDS):
        motions = _motions(values)
        weights = [group.weights(composed(motions, group.first, group.second)) for group in groups]
        sizes = [np.linalg.norm(error, axis=1) for error in _errors(groups, weights, motions)]
        limit = max(_OUTLIER, 3.0 * float(np.median(np.concatenate(sizes))))
        agrees = [size < limit for size in sizes]
        used = [
            replace(
                group,
                points_m=group.points_m[good],
                seen_px=group.seen_px[good],
                scale=group.scale[good],
            )
            for group, good in zip(groups, agrees, strict=True)
        ]
        used_weights = [weight[good] for weight, good in zip(weights, agrees, strict=True)]

        def residuals(
            x: Floats, used: list[Sightings] = used, weights: list[Floats] = used_weights
        ) -> Floats:
            return np.concatenate([e.ravel() for e in _errors(used, weights, _motions(x))])

        solved: Any = least_squares(
            residuals,
            values,
            jac_sparsity=_sparsity(used, count) if count > 1 else None,
            x_scale="jac",
            loss="soft_l1",
        )
        values = solved.x
    normal = csr_array(solved.jac).T @ csr_array(solved.jac)
    excess = max(1.0, 2.0 * solved.cost / max(len(solved.fun) - len(values), 1))
    variance = np.diag(np.linalg.pinv(normal.toarray())).reshape(count, 2, 3).sum(axis=2) * excess
    return Adjusted(
        _motions(values), np.sqrt(variance[:, 1]), np.sqrt(variance[:, 0]), tuple(agrees)
    )


def composed(motions: Floats, first: int, second: int) -> Floats:
    """(3, 4) motion from one position's axes to those of a later one."""
    turn, shift = np.eye(3), np.zeros(3)
    for motion in motions[first:second]:
        turn, shift = motion[:, :3] @ turn, motion[:, :3] @ shift + motion[:, 3]
    return np.column_stack([turn, shift])


def _values(motion: Floats) -> Floats:
    """(6,) rotation vector, and the place of the second camera in the axes of the first."""
    place = -motion[:, :3].T @ motion[:, 3]
    return np.concatenate([Rotation.from_matrix(motion[:, :3]).as_rotvec(), place])


def _motions(values: Floats) -> Floats:
    parts = values.reshape(-1, 2, 3)
    turns = Rotation.from_rotvec(parts[:, 0]).as_matrix()
    return np.concatenate([turns, -turns @ parts[:, 1, :, None]], axis=2)


def _errors(
    groups: Sequence[Sightings], weights: Sequence[Floats], motions: Floats
) -> list[Floats]:
    """(n, 3) weighted errors of each group; an error without a measurement is 0."""
    errors = []
    for group, weight in zip(groups, weights, strict=True):
        motion = composed(motions, group.first, group.second)
        moved_m = moved(group.points_m, motion)
        off = group.predicted_px(moved_m) - group.seen_px
        has_depth = np.isfinite(group.seen_px[:, 2])
        off[~has_depth, 2] = 0.0
        error = np.nan_to_num(np.einsum("nij,nj->ni", weight, off), nan=1e3)
        error[~has_depth, 2] = 0.0
        errors.append(error)
    return errors


def _sparsity(groups: Sequence[Sightings], count: int) -> coo_array:
    """Which errors depend on which values."""
    rows, columns = [], []
    start = 0
    for group in groups:
        size = 3 * len(group.scale)
        at = np.arange(6 * group.first, 6 * group.second)
        rows.append(np.repeat(np.arange(start, start + size), len(at)))
        columns.append(np.tile(at, size))
        start += size
    places = (np.concatenate(rows), np.concatenate(columns))
    return coo_array((np.ones(len(places[0]), np.int8), places), shape=(start, 6 * count))
