"""Backbone-curve fitting: joint angles for a curve in space, links at their length.

Step one follows Yamada and Hirose (Study of active cord mechanism: approximations to continuous
curves of a multi-joint body, J. RSJ 26, 2008). In a frame that moves along the curve without
turning about it (R. L. Bishop, There is more than one way to frame a curve, 1975) the curve bends
to the left by ``k_left(s)`` and upwards by ``k_up(s)``. A joint gets the bend of its own direction
over its stretch. The error grows along the body. Step two reduces it by Gauss-Newton on the
distances of all joints from the curve, similar to R. L. Hatton, H. Choset, Generating gaits for
snake robots: annealed chain fitting and keyframe wave extraction, Autonomous Robots 28, 2010.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.links import (
    BodyView,
    body_in_world,
    chain_axes,
    chain_jacobian,
    chain_points_m,
    half_lengths_m,
)
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

SAMPLES_A_LINK = 24
"""Number of samples of the curve, over the length of a mean link."""
ROUNDS = 40
STEP_RAD = 0.3
"""Largest change of an angle in a round."""
STIFF_M_RAD = 1e-5
"""Distance that is given up rather than bend a joint by a radian: picks one of many fits."""
DONE = 1e-7
"""Largest change, in metres and radians, of the last round."""


class SpaceCurve:
    """A curve by arc length, densely sampled."""

    def __init__(self, robot: "RobotConfig", curve_m: ArrayLike) -> None:
        points = np.asarray(curve_m, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
            raise InputError(
                f"the curve has shape {points.shape}; expected 4 or more points (x, y, z)"
            )
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not np.isfinite(points).all() or steps.min() <= 0.0:
            raise InputError("the curve's points must be finite, and neighbours must differ")
        spline = CubicSpline(np.concatenate([[0.0], steps.cumsum()]), points)
        fine = np.linspace(0.0, spline.x[-1], 20 * len(points) + 2000)
        steps = np.linalg.norm(np.diff(spline(fine), axis=0), axis=1)
        run = np.concatenate([[0.0], steps.cumsum()])
        if run[-1] < robot.length_m * (1.0 - 1e-6):
            raise InputError(
                f"the curve is {run[-1]:.3f} m long; robot {robot.name} has {robot.length_m:.3f} m"
            )
        count = int(np.ceil(run[-1] / robot.mean_link_length_m * SAMPLES_A_LINK)) + 1
        self.run_m = np.linspace(0.0, run[-1], count)
        fine_parameter = np.interp(self.run_m, run, fine)
        self.points_m: Floats = spline(fine_parameter)
        self._by_run = CubicSpline(self.run_m, self.points_m)
        tangents = self._by_run(self.run_m, 1)
        self.tangents: Floats = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
        self._tree = cKDTree(self.points_m)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """Nearest points of the curve to points (N, 3), and the tangents there, (N, 3) each."""
        run = self.run_m[self._tree.query(points)[1]]
        for _ in range(2):
            along = self._by_run(run, 1)
            run = run + ((points - self._by_run(run)) * along).sum(axis=1)
            run = np.clip(run, 0.0, self.run_m[-1])
        along = self._by_run(run, 1)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return self._by_run(run), np.asarray(along)


@dataclass(frozen=True, slots=True)
class BackboneFit:
    """A chain on a curve."""

    joint_rad: Floats
    """(J,) joint angles of the fit, rad."""
    head_m: Floats
    """(3,) tip of the head."""
    head_rotation: Floats
    """(3, 3) columns: the head's forward, left and up."""
    points_m: Floats
    """(J + 2, 3) head's tip, joints, tail's end: exactly their links apart."""
    distance_m: Floats
    """(J + 2,) of each from the curve: the residual."""

    @property
    def residual_m(self) -> float:
        """Largest distance from the curve."""
        return float(self.distance_m.max())


def fit_backbone(
    robot: "RobotConfig", curve_m: ArrayLike, roll_rad: float = 0.0, *, refine: bool = True
) -> BackboneFit:
    """Fit the chain to a curve given by points (N, 3) from the head backwards.

    Args:
        robot: yaw joints alone fit only a plane curve.
        curve_m: at least as long as the robot; points need not be spaced evenly.
        roll_rad: turn of the body about the curve; 0 keeps the head's up axis closest to z.
        refine: False stops after step one.

    Raises:
        InputError: fewer than four points, a curve shorter than the robot, or repeated points.

    """
    curve = SpaceCurve(robot, curve_m)
    rotation, joints = _starting_shape(robot, curve, roll_rad)
    limit = np.array(robot.limit_rad)
    joints = np.clip(joints, -limit, limit)
    tip = curve.points_m[0].copy()
    for _ in range(ROUNDS if refine else 0):
        body = _body(robot, joints, tip, rotation)
        points = chain_points_m(robot, body)
        near_m, along = curve.nearest(points)
        away = points - near_m
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        across[0] = np.eye(3)  # the head's tip stays at the curve's start
        miss = np.einsum("nij,nj->ni", across, away).ravel()
        slopes = chain_jacobian(points, chain_axes(robot, body))
        slopes = np.einsum("nij,njk->nik", across, slopes)
        slopes = slopes.reshape(len(miss), -1)
        free = np.ones(slopes.shape[1], dtype=bool)
        rows = np.vstack([slopes, STIFF_M_RAD * np.eye(len(free))[6:]])
        change = np.zeros(len(free))
        for _ in range(3):  # joints at their limit stop there, the others continue
            right = np.concatenate([-miss, -STIFF_M_RAD * joints]) - rows[:, ~free] @ change[~free]
            change[free] = np.linalg.lstsq(rows[:, free], right, rcond=None)[0]
            bends = joints + change[6:]
            beyond = np.abs(bends) > limit
            if not beyond.any():
                break
            change[6:][beyond] = np.clip(bends, -limit, limit)[beyond] - joints[beyond]
            free[6:] &= ~beyond
        change *= min(1.0, STEP_RAD / max(np.abs(change[3:]).max(), 1e-12))
        tip = tip + change[:3]
        rotation = rotation_by(change[3:6]) @ rotation
        joints = np.clip(joints + change[6:], -limit, limit)
        if np.abs(change).max() < DONE:
            break
    points = chain_points_m(robot, _body(robot, joints, tip, rotation))
    away_m = np.linalg.norm(points - curve.nearest(points)[0], axis=1)
    return BackboneFit(joints, tip, rotation, points, away_m)


def _body(robot: "RobotConfig", joint_rad: Floats, tip_m: Floats, rotation: Floats) -> BodyView:
    """Forward kinematics from the head's tip (3,) and axes (3, 3)."""
    head_m = tip_m - half_lengths_m(robot)[0] * rotation[:, 0]
    return body_in_world(robot, BodyPose(0.0, head_m, rotation), joint_rad)


def _starting_shape(
    robot: "RobotConfig", curve: SpaceCurve, roll_rad: float
) -> tuple[Floats, Floats]:
    """Rotation of the head and bends of the joints, from the curve's bends in its Bishop frame."""
    forward = -curve.tangents
    up = np.array([0.0, 0.0, 1.0])
    if abs(forward[0] @ up) > 0.99:
        up = np.array([-1.0, 0.0, 0.0])
    up = up - (up @ forward[0]) * forward[0]
    up /= np.linalg.norm(up)
    up = np.cos(roll_rad) * up - np.sin(roll_rad) * np.cross(up, forward[0])
    bend = np.zeros((len(forward), 2))  # cumulative bend: to the left, upwards
    for k in range(1, len(forward)):
        left = np.cross(up, forward[k - 1])
        change = forward[k - 1] - forward[k]
        bend[k] = bend[k - 1] + (change @ left, change @ up)
        up = up - (up @ forward[k]) * forward[k]
        up /= np.linalg.norm(up)
        if k == 1:
            first = up
    joints = np.zeros(robot.joint_count)
    joint_ends = np.array(robot.link_ends)
    for column, axis_joints in ((0, robot.yaw_joints), (1, robot.pitch_joints)):
        if not axis_joints:
            continue
        places_m = joint_ends[np.array(axis_joints) + 1]
        spacing_m = float(places_m[-1] - places_m[0]) / max(len(axis_joints) - 1, 1) or 1.0
        reach = places_m[:, None] + 0.5 * spacing_m * np.array([-1.0, 1.0])
        ends = np.interp(reach * robot.mean_link_length_m, curve.run_m, bend[:, column])
        joints[list(axis_joints)] = ends[:, 1] - ends[:, 0]
    start = forward[: round(SAMPLES_A_LINK * joint_ends[1]) + 1].mean(axis=0)
    start /= np.linalg.norm(start)
    top = first - (first @ start) * start
    top /= np.linalg.norm(top)
    return np.stack([start, np.cross(top, start), top], axis=1), joints
