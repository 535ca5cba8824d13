"""The prototype bent along a path and stood on the ground ([KP] 4.4).

A point of the prototype at x along its line moves to the path's normal at arc length x, at the same
distance to the left. So a foot on the ground stays where it is on any path. The body is then turned
upright on the plane that fits the ground below it. The feet stand on the ground itself; the paper
leaves them on that plane.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.animals.legged.leg import LegFrame, leg_joints_m
from snakewalk.controller.animals.legged.prototype import Prototype
from snakewalk.controller.terrain.path import SplinePath

_KNOT_M = 0.03
"""Distance between the knots of the smooth curve: a path is tabulated every centimetre."""


@dataclass(frozen=True, slots=True)
class AnimalMotion:
    """An animal on the ground of a world: T frames, m."""

    time_s: Floats
    """(T,) times of the frames, s."""
    spine_m: Floats
    """(T, S + 1, 3) points of the spine, head first, m."""
    joints_m: tuple[Floats, Floats, Floats, Floats]
    """(T, J, 3) of each leg, from its root to its toe: front left, front right, hind left, hind
    right."""
    foot_m: Floats
    """(T, 4, 3) where the feet should be."""
    sole_m: Floats
    """(4,) height of the toes' ends of the legs above the ground."""
    up: Floats
    """(T, 3) normal of the local ground plane."""
    on_ground: Bools
    """(T, 4) whether each foot is on the ground."""

    @property
    def hip_m(self) -> Floats:
        """(T, 4, 3) roots of the legs: hips, or pivots of the shoulder blades."""
        return np.stack([leg[:, 0] for leg in self.joints_m], axis=1)

    @property
    def end_m(self) -> Floats:
        """(T, 4, 3) where the legs end: at the feet, if they reach."""
        end = np.stack([leg[:, -1] for leg in self.joints_m], axis=1)
        return end - self.sole_m[:, None] * self.up[:, None]

    def knee_m(self, animal: AnimalConfig) -> Floats:
        """(T, 4, 3) knees or elbows: the lower ends of the upper segments."""
        knee = [2 if pair.blade > 0.0 else 1 for pair in animal.leg_pairs for _ in range(2)]
        return np.stack([leg[:, k] for leg, k in zip(self.joints_m, knee, strict=True)], axis=1)


class PathNormals:
    """A path as a smooth curve with normals; it continues straight beyond its ends."""

    def __init__(self, path: SplinePath) -> None:
        self.length_m = path.length_m
        knots = np.linspace(0.0, path.length_m, max(4, round(path.length_m / _KNOT_M) + 1))
        self._curve = CubicSpline(knots, path.position(knots))
        self._slope, self._bend = self._curve.derivative(), self._curve.derivative(2)

    def bent(self, points: Floats) -> Floats:
        """Points (..., 3) of a line on the path: (..., 3), z as it was.

        Raises:
            InputError: a point is further from the path than the path's centre of curvature.

        """
        s = points[..., 0]
        offset_m = points[..., 1]
        on = np.clip(s, 0.0, self.length_m)
        slope = self._slope(on)
        bend = self._bend(on)
        speed = np.hypot(slope[..., 0], slope[..., 1])
        forward = slope / speed[..., None]
        curvature = (slope[..., 0] * bend[..., 1] - slope[..., 1] * bend[..., 0]) / speed**3
        inside = (on == s) & (offset_m * curvature >= 1.0)
        if inside.any():
            worst = int(np.argmax(np.where(inside, offset_m * curvature, 0.0)))
            raise InputError(
                f"path: its radius is {1.0 / abs(curvature.ravel()[worst]):.3f} m after "
                f"{on.ravel()[worst]:.2f} m, and a foot is {abs(offset_m.ravel()[worst]):.3f} m "
                "to the side; choose a smaller animal (length_m), or move the waypoints"
            )
        left = np.stack([-forward[..., 1], forward[..., 0]], axis=-1)
        plan = self._curve(on) + (s - on)[..., None] * forward + offset_m[..., None] * left
        return np.concatenate([plan, points[..., 2:]], axis=-1)


def transformed(
    animal_prototype: Prototype, animal: AnimalConfig, path: SplinePath, ground: HeightField | None
) -> AnimalMotion:
    """Bend a prototype along a path and stand it on the ground; None is a level floor.

    Raises:
        InputError: the path bends more sharply than the animal is wide.

    """
    normals = PathNormals(path)
    spine, hip, foot = (
        normals.bent(p)
        for p in (animal_prototype.spine_m, animal_prototype.hip_m, animal_prototype.foot_m)
    )
    foot[..., 2] += _elevation_m(ground, foot)
    below = np.concatenate([spine[..., :2], foot[..., :2]], axis=1)
    middle, height_m, up = local_planes(below, _elevation_m(ground, below))
    turn = _upright(up)
    centre = np.concatenate([middle, np.zeros((len(middle), 1))], axis=-1)
    base = np.concatenate([middle, height_m[:, None]], axis=-1)

    def stood(points: Floats) -> Floats:
        turned = np.einsum("tij,tkj->tki", turn, points - centre[:, None])
        return np.asarray(turned + base[:, None])

    spine = stood(spine)
    hip = stood(hip)
    frame = body_frame(spine, up)
    front_left, front_right, hind_left, hind_right = (
        leg_joints_m(
            animal.leg_pairs[k // 2],
            animal.length_m,
            hip[:, k],
            foot[:, k] + animal.leg_pairs[k // 2].sole_height * animal.length_m * up,
            animal_prototype.air[:, k],
            frame,
            1.0 if k % 2 == 0 else -1.0,
        )
        for k in range(4)
    )
    joints = front_left, front_right, hind_left, hind_right
    sole_m = animal.length_m * np.repeat([pair.sole_height for pair in animal.leg_pairs], 2)
    return AnimalMotion(
        animal_prototype.time_s, spine, joints, foot, sole_m, up, animal_prototype.on_ground
    )


def local_planes(plan_m: Floats, height_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Least-squares planes under bodies.

    Args:
        plan_m: (T, K, 2) places.
        height_m: (T, K) of the ground there.

    Returns:
        middles (T, 2) of the places, heights (T,) of the planes there, upward normals (T, 3).

    """
    middle = plan_m.mean(axis=1)
    level = height_m.mean(axis=1)
    off = plan_m - middle[:, None]
    rise = height_m - level[:, None]
    xx, xy, yy = ((off[..., a] * off[..., b]).sum(axis=1) for a, b in ((0, 0), (0, 1), (1, 1)))
    zx, zy = ((off[..., a] * rise).sum(axis=1) for a in (0, 1))
    determinant = xx * yy - xy * xy
    gx, gy = (zx * yy - zy * xy) / determinant, (zy * xx - zx * xy) / determinant
    normal = np.stack([-gx, -gy, np.ones_like(gx)], axis=-1)
    return middle, level, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _upright(up: Floats) -> Floats:
    """(T, 3, 3) smallest turns from z to unit vectors (T, 3)."""
    axis = np.stack([-up[:, 1], up[:, 0], np.zeros(len(up))], axis=-1)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine, up[:, 2:])
    return Rotation.from_rotvec(axis * (angle / np.maximum(sine, 1e-12))).as_matrix()


def body_frame(spine_m: Floats, up: Floats) -> LegFrame:
    """Directions of bodies with spines (T, S + 1, 3) that stand on planes of normals (T, 3)."""
    left = np.cross(up, spine_m[:, 0] - spine_m[:, -1])
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    return LegFrame(np.cross(left, up), left, up)


def _elevation_m(ground: HeightField | None, points_m: Floats) -> Floats:
    if ground is None:
        return np.zeros(points_m.shape[:-1])
    return ground.elevation_m(points_m[..., 0], points_m[..., 1])
