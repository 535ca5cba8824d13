"""Relative pose of two positions by reprojection of a local model's points ([KP] 3.3)."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, project
from snakewalk.controller.mapping.mosaic.scale_matches import ScaleMatches

LEAST_INLIERS = 12
"""Number of inliers below which a pose is an accident (ours)."""
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
    error_px: float
    """Root mean square of the inliers' reprojection errors."""

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
    error_px = float(np.sqrt((off_px[kept] ** 2).mean())) if kept.any() else float("nan")
    return RelativePose(np.asarray(rotation, float), translation_m, kept, error_px)


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
