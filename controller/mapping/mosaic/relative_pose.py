"""Relative pose of two positions by reprojection of a local model's points ([KP] 3.3)."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.mosaic.adjustment import Adjusted, Sightings, adjusted
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, moved, project
from snakewalk.controller.mapping.mosaic.scale_matches import (
    ScaleMatches,
    match_around,
    match_over_scale,
    similar_points,
)

LEAST_INLIERS = 12
"""Number of inliers below which a pose is an accident (ours)."""
_MOST_STARTS = 5
_RIVAL = 0.65
"""Share of the most matches from which a start may be the right one too (ours)."""
_SAME_WAY = 0.1
"""Relative difference of the distances of two starts that are the same motion (ours)."""
_WIDE_RADIUS_PX = 16
_RADII_PX = (8, 4)
"""Search radii around a first and a settled motion (ours)."""
_TOLERANCE_PX = 3.0
"""Reprojection error of an inlier, per unit of its match's scale (ours)."""


@dataclass(frozen=True, slots=True)
class RelativePose:
    """Pose: a point p of the first position is ``rotation @ p + translation`` at the second."""

    rotation: Floats
    """(3, 3) rotation from the first position to the second."""
    translation_m: Floats
    """(3,) translation from the first position to the second, m."""
    inliers: Bools
    """(n,) matches that agree with the pose."""

    def moved(self, points_m: Floats) -> Floats:
        """Points (..., 3) of the first position in the axes of the second."""
        return points_m @ self.rotation.T + self.translation_m

    def back(self, points_m: Floats) -> Floats:
        """Points (..., 3) of the second position in the axes of the first."""
        return (points_m - self.translation_m) @ self.rotation


def relative_pose(first: LocalModel, second: LocalModel, matches: ScaleMatches) -> RelativePose:
    """Minimise ``sum dist(q, K (R P + T))^2`` over the largest consistent set of matches.

    Raises:
        InputError: too few matches agree.

    """
    columns, rows = np.rint(matches.first_px).astype(int).T
    points_m = first.points_m[rows, columns]
    count = len(points_m)
    kept = np.zeros(count, bool)
    if count >= LEAST_INLIERS:
        cv2.setRNGSeed(0)
        ok, turn, shift, chosen = cv2.solvePnPRansac(
            points_m,
            matches.second_px,
            second.camera,
            None,
            iterationsCount=2000,
            reprojectionError=2.0 * _TOLERANCE_PX,
            confidence=0.9999,
            flags=cv2.SOLVEPNP_SQPNP,
        )
        if ok and chosen is not None and len(chosen) >= LEAST_INLIERS:
            kept[chosen.ravel()] = True
    for _ in range(3):
        if kept.sum() < LEAST_INLIERS:
            raise InputError(
                f"{int(kept.sum())} of {count} matches agree on a relative pose, fewer than "
                f"{LEAST_INLIERS}; record the pictures closer together, or set `distance_m`"
            )
        turn, shift = cv2.solvePnPRefineLM(
            points_m[kept], matches.second_px[kept], second.camera, None, turn, shift
        )
        rotation = cv2.Rodrigues(turn)[0]
        translation_m = np.asarray(shift, float).ravel()
        projected_px = project(second.camera, points_m @ rotation.T + translation_m)
        off_px = np.linalg.norm(projected_px - matches.second_px, axis=1)
        kept = off_px <= _TOLERANCE_PX * np.sqrt(matches.scale)
    return RelativePose(np.asarray(rotation, float), translation_m, kept)


def estimated_motion(
    first: LocalModel, second: LocalModel, distance_m: float | None = None
) -> tuple[Floats, ScaleMatches]:
    """Match, estimate the motion, and match again around the estimate until it is settled.

    ``distance_m`` is a guess of the way forward.

    Returns:
        Motion (3, 4) from the first position's axes to the second's, and the last matches.

    Raises:
        InputError: too few matches agree.

    """
    for match in (similar_points, match_over_scale):
        best = best_start(first, second, match(first, second), distance_m)
        if best:
            break
    else:
        raise InputError(
            f"fewer than {LEAST_INLIERS} matches agree on a relative pose; record the pictures "
            "closer together, or set `distance_m`"
        )
    motion, matches = best
    for radius_px in _RADII_PX:
        motion = _adjusted_to(first, second, motion, matches).motions[0]
        matches = matches_around(first, second, motion, radius_px)
        if len(matches.scale) < LEAST_INLIERS:
            raise InputError(
                f"{len(matches.scale)} matches agree on a relative pose, fewer than "
                f"{LEAST_INLIERS}; record the pictures closer together"
            )
    return motion, matches


def _adjusted_to(
    first: LocalModel, second: LocalModel, motion: Floats, matches: ScaleMatches
) -> Adjusted:
    return adjusted([Sightings.of_matches((0, 1), (first, second), matches)], motion[None])


def matches_around(
    first: LocalModel, second: LocalModel, motion: Floats, radius_px: int
) -> ScaleMatches:
    """Match around the places that a motion (3, 4) from the first to the second predicts."""
    moved_m = moved(first.points_m, motion)
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = np.where(moved_m[..., 2] > 0.0, first.points_m[..., 2] / moved_m[..., 2], np.nan)
        scale *= second.camera[0, 0] / first.camera[0, 0]
    return match_around(first, second, project(second.camera, moved_m), scale, radius_px)


def _starts(first: LocalModel, second: LocalModel, matches: ScaleMatches) -> list[Floats]:
    """Motions that many matches support: of repeated patterns more than one."""
    starts = []
    for _ in range(_MOST_STARTS):
        try:
            pose = relative_pose(first, second, matches)
        except InputError:
            break
        starts.append(np.column_stack([pose.rotation, pose.translation_m]))
        rest = ~pose.inliers
        matches = ScaleMatches(
            matches.first_px[rest],
            matches.second_px[rest],
            matches.scale[rest],
        )
    return starts


def best_start(
    first: LocalModel,
    second: LocalModel,
    matches: ScaleMatches,
    distance_m: float | None = None,
) -> tuple[Floats, ScaleMatches] | None:
    """Choose the motion (3, 4) with which most matches agree; return it and these matches.

    Repeated patterns support several motions. The one near a stated distance is chosen. None: fewer
    than twelve matches agree.

    Raises:
        InputError: two different motions explain the pictures, and no distance is stated.

    """
    starts = _starts(first, second, matches)
    if distance_m is not None:
        starts.append(np.column_stack([np.eye(3), [0.0, 0.0, -distance_m]]))
    tried = []
    agreeing = []
    for start in starts:
        around = matches_around(first, second, start, _WIDE_RADIUS_PX)
        if len(around.scale) >= LEAST_INLIERS:
            tried.append((start, around))
            agreeing.append(int(_adjusted_to(first, second, start, around).agrees[0].sum()))
    most = max(agreeing, default=0)
    if most < LEAST_INLIERS:
        return None
    rivals = [pair for pair, count in zip(tried, agreeing, strict=True) if count >= _RIVAL * most]
    ways_m = [float(np.linalg.norm(start[:, 3])) for start, _ in rivals]
    if distance_m is not None:
        return rivals[int(np.argmin(np.abs(np.array(ways_m) - distance_m)))]
    if max(ways_m) - min(ways_m) > _SAME_WAY * max(ways_m):
        raise InputError(
            "the pictures repeat themselves: they agree on distances of "
            f"{' m and '.join(f'{way_m:.2f}' for way_m in sorted(ways_m))} m; set `distance_m`"
        )
    return tried[agreeing.index(most)]


def pose_error(pose: RelativePose, first_pose: Floats, second_pose: Floats) -> tuple[float, float]:
    """Error of a pose for known poses (3, 4) of the positions, camera to world.

    Returns:
        Distance of the second camera from its place, m, and the angle of its axes, rad.

    """
    turn = second_pose[:, :3].T @ first_pose[:, :3]
    shift = second_pose[:, :3].T @ (first_pose[:, 3] - second_pose[:, 3])
    place = -turn.T @ shift
    found_place = -pose.rotation.T @ pose.translation_m
    angle_rad = float(Rotation.from_matrix(pose.rotation.T @ turn).magnitude())
    return float(np.linalg.norm(found_place - place)), angle_rad
