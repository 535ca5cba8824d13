"""The ground in front of a pair of cameras: disparities to points to a map with holes.

The map's frame: origin on the ground below the left camera, x where the camera looks, y to the
left, z up.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.disparity import match
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from snakewalk.controller.terrain.elevation_map import ElevationMap
from snakewalk.drivers.attitude import about_up

DISPARITY_ERROR_PX = 0.3
"""Standard error that is assumed for a disparity (ours): the median on a real pair is 0.15 px."""
MOST_ROLL_DEG = 3.0
"""A camera is set up upright to about this angle (ours): a larger roll may be a slope."""
_TRIALS = 300
_SAMPLE = 20_000
"""Points that a plane is searched in."""
_LEAST_UP_COSINE = np.cos(np.radians(70.0))
"""A ground's normal leans from the camera's up by at most 70 degrees (ours)."""
_LEAST_POINTS = 2
"""Least number of points in a known cell (ours)."""
_LEAST_GROUND = 0.2
"""Share of the points that must lie on a ground that is fitted (ours)."""


@dataclass(frozen=True, slots=True)
class CameraStand:
    """Pose of the left camera above the ground."""

    height_m: float
    tilt_rad: float
    """Tilt of the camera's axis, downwards from the level."""
    roll_rad: float
    """Roll of the camera about its axis; positive if the picture's right side is down."""

    def world_from_camera(self) -> Floats:
        """(3, 3) rotation from the camera's axes (right, down, forward) to (ahead, left, up)."""
        ct, st = np.cos(self.tilt_rad), np.sin(self.tilt_rad)
        upright = np.array([[0.0, -st, ct], [-1.0, 0.0, 0.0], [0.0, -ct, -st]])
        return upright @ about_up(self.roll_rad)

    @classmethod
    def on_plane(cls, normal: Floats, height_m: float) -> "CameraStand":
        """Stand over a plane with an upward unit normal (3,) in the camera's axes."""
        # Up is (-sin(roll) cos(tilt), -cos(roll) cos(tilt), -sin(tilt)) in the camera's axes.
        tilt_rad = float(np.arcsin(np.clip(-normal[2], -1.0, 1.0)))
        return cls(height_m, tilt_rad, float(np.arctan2(-normal[0], -normal[1])))


@dataclass(frozen=True, slots=True)
class StereoGround:
    """A map and its statistics."""

    elevation: ElevationMap
    disparity: Floats
    """(H, W) px of the rectified left picture, NaN where unknown."""
    stand: CameraStand
    fitted: bool
    """Whether the stand was fitted to the points, as no one gave it."""
    known_share: float
    """Share of the pixels that show something that have a disparity."""
    used_share: float
    """Share of the pixels that show something that are in the map."""


def stereo_ground(
    pair: RectifiedPair,
    count: int,
    spacing_m: float,
    error_m: float,
    stand: CameraStand | None = None,
    far_m: float = np.inf,
    *,
    is_level: bool = False,
) -> StereoGround:
    """Map the ground in a pair of pictures.

    Args:
        pair: rectified pictures.
        count: number of disparities, from that of a point at infinity.
        spacing_m: between the map's samples.
        error_m: largest expected error of a point, ``distance * DISPARITY_ERROR_PX / disparity``.
        stand: height, tilt and roll of the camera; None fits a plane to the visible points.
        far_m: largest horizontal distance of points.
        is_level: the visible plane is level, even if it is tilted sideways against the camera.

    Raises:
        InputError: no ground is found, its vertical is unknown, or nothing is near enough for the
            error.

    """
    disparity, used, expected_m = seen_points(pair, count, error_m)
    if len(used) < 100:
        raise InputError(
            f"stereo: {len(used)} points are known to {error_m:g} m: nothing in the pictures "
            "is matched, or all is too far; look at the pictures, --disparities and --error"
        )
    fitted = stand is None
    if stand is None:
        stand = fit_ground(used, expected_m)
        if not is_level:
            require_upright(stand)
    world = used @ stand.world_from_camera().T
    world[:, 2] += stand.height_m
    world = world[world[:, 0] <= far_m]
    elevation = ElevationMap.of_points(world, spacing_m, "median", _LEAST_POINTS)
    visible_px = max(int(pair.seen.sum()), 1)
    return StereoGround(
        elevation,
        disparity,
        stand,
        fitted,
        float(np.isfinite(disparity).sum()) / visible_px,
        len(world) / visible_px,
    )


def require_upright(stand: CameraStand) -> None:
    """Reject a fitted stand with roll: pictures do not show whether the ground is level.

    Raises:
        InputError: the ground tilts sideways against the camera.

    """
    roll_deg = float(np.degrees(stand.roll_rad))
    if abs(roll_deg) > MOST_ROLL_DEG:
        lower = "right" if roll_deg < 0.0 else "left"
        raise InputError(
            f"stereo: the ground's {lower} side is lower by {abs(roll_deg):.1f} degrees, by its "
            "own slope or by a rolled camera; state the stand (--height, --tilt, --roll), or use "
            "--level-ground"
        )


def disparities(pair: RectifiedPair, count: int) -> Floats:
    """(H, W) disparities, ``count`` of them from that of a point at infinity; NaN if not seen."""
    least = max(0, int(np.floor(-pair.offset_px)))
    return np.where(pair.seen, match(pair.left, pair.right, count, least), np.nan)


def seen_points(pair: RectifiedPair, count: int, error_m: float) -> tuple[Floats, Floats, Floats]:
    """Disparities (H, W), points (n, 3), and their expected errors (n,).

    Arguments as in ``stereo_ground``.
    """
    disparity = disparities(pair, count)
    points = pair.points_m(disparity)
    distance = np.linalg.norm(points, axis=-1)
    with np.errstate(invalid="ignore"):
        expected_m = distance * DISPARITY_ERROR_PX / (disparity + pair.offset_px)
        good = expected_m <= error_m
    return disparity, points[good], expected_m[good]


def fit_ground(points_m: Floats, error_m: Floats) -> CameraStand:
    """Stand of a camera over the plane of most points (n, 3), within three errors (n,).

    The plane of largest consensus among random ones is refined by least squares. It is level only
    if the ground is: on a slope give the stand.

    Raises:
        InputError: no plane below the camera has a fifth of the points.

    """
    rng = np.random.default_rng(0)
    some = rng.permutation(len(points_m))[:_SAMPLE]
    points = points_m[some]
    reach = 3.0 * error_m[some] + 1e-4
    best = np.zeros(4)
    most = 0
    for _ in range(_TRIALS):
        a, b, c = points[rng.integers(len(points), size=3)]
        normal = np.cross(b - a, c - a)
        size = np.linalg.norm(normal)
        if size < 1e-12:
            continue
        normal = normal / size * (-1.0 if normal[1] > 0.0 else 1.0)  # up: y points down
        if -normal[1] < _LEAST_UP_COSINE or normal @ a >= 0.0:
            continue
        points_near = int((np.abs(points @ normal - normal @ a) <= reach).sum())
        if points_near > most:
            best = np.array([*normal, normal @ a])
            most = points_near
    if most < _LEAST_GROUND * len(points):
        raise InputError(
            "stereo: no ground is seen: no plane below the camera holds a fifth of the points; "
            "give the camera's stand: --height, --tilt, --roll"
        )
    for _ in range(5):
        on = np.abs(points @ best[:3] - best[3]) <= reach
        weight = 1.0 / reach[on]
        middle = np.average(points[on], axis=0, weights=weight**2)
        _, _, turned = np.linalg.svd((points[on] - middle) * weight[:, None], full_matrices=False)
        normal = turned[2] * (-1.0 if turned[2, 1] > 0.0 else 1.0)
        best = np.array([*normal, normal @ middle])
    return CameraStand.on_plane(best[:3], -float(best[3]))
