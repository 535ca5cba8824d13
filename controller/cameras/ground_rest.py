"""A body at rest on known ground: height and attitude from place and shape."""

from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.drivers.attitude import about_up, heading_of, rotation_by
from snakewalk.drivers.types import BodyPose

Heights = Callable[[Floats], Floats]
"""Heights (...,) of the ground at places (..., 2)."""
_ROUNDS = 3
_LEAST_SPREAD_M2 = 4e-4
"""A body narrower than this across its line does not show the slope across it (ours)."""


def heights_of(ground: HeightField | None) -> Heights | None:
    """Return the heights of known ground, NaN at a NaN place; None for a level floor."""
    if ground is None:
        return None

    def heights(places_m: Floats) -> Floats:
        is_known = np.asarray(np.isfinite(places_m).all(axis=-1))
        filled_m = np.where(is_known[..., None], places_m, 0.0)
        return np.where(is_known, ground.elevation_m(filled_m[..., 0], filled_m[..., 1]), np.nan)

    return heights


class GroundRest:
    """Puts a body on the ground: the plane of its links fits the ground below."""

    def __init__(self, robot: RobotConfig, heights: Heights | None) -> None:
        self._spine = SpineLinks.of(robot)
        self._heights = heights
        self._radius_m = robot.body_radius_m

    def pose(self, place: Floats, joint_rad: Floats, time_s: float) -> BodyPose:
        """Return the head link's pose from its place (3,): x, y, heading."""
        rotation = about_up(place[2])
        head_m = np.array([*place[:2], self._radius_m])
        if self._heights is None:
            return BodyPose(time_s, head_m, rotation)
        for _ in range(_ROUNDS):
            links_m = self._spine.in_world(BodyPose(time_s, head_m, rotation), joint_rad).link_m
            above_m = self._heights(links_m[:, :2]) + self._radius_m - links_m[:, 2]
            lift_m, slope = _plane(links_m[:, :2] - head_m[:2], above_m)
            head_m[2] += lift_m
            rotation = rotation_by(np.array([slope[1], -slope[0], 0.0])) @ rotation
            # tilting turns the head slightly about the vertical; keep the measured heading
            turn = place[2] - heading_of(rotation)
            rotation = about_up(turn) @ rotation
        return BodyPose(time_s, head_m, rotation)


def _plane(places_m: Floats, values_m: Floats) -> tuple[float, Floats]:
    """Return height at the origin and slope (2,) of the plane through values at places (n, 2).

    Directions without spread get no slope.
    """
    middle = places_m.mean(axis=0)
    off = places_m - middle
    spread, axes = np.linalg.eigh(off.T @ off / len(off))
    moment = axes.T @ (off.T @ (values_m - values_m.mean()) / len(off))
    slope = axes @ np.where(spread > _LEAST_SPREAD_M2, moment / np.maximum(spread, 1e-12), 0.0)
    return float(values_m.mean() - slope @ middle), slope
