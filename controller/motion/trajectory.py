"""Timed points for joints from another program: checked as a whole, then splined."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PPoly

from snakewalk.config.arrays import Floats, Indices
from snakewalk.config.errors import InputError
from snakewalk.config.joint_names import numbered_joint_names
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.motion.command import POINTS_MAX, JointTrajectory
from snakewalk.controller.motion.refusals import NAME_MAX

START_RAD = 0.05
"""Largest distance of a joint from a first point at 0 s (ours)."""
_SAMPLES = 32
"""Points of each piece at which the limits are checked."""
_SLACK = 1.0 + 1e-6
_REST_SPEED_RAD_S = 1e-3

JointNumbers = Indices


class JointsNow(NamedTuple):
    """Commanded state of the joints when a trajectory begins."""

    angle_rad: Floats
    """(J,) commanded joint angles, rad."""
    speed_rad_s: Floats
    """(J,) commanded joint speeds, rad/s."""


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits and names of a robot's joints for commands."""

    names: tuple[str, ...]
    """J names, head first."""
    robot: str
    angle_rad: Floats
    """(J,) largest joint angles, rad."""
    speed_rad_s: float
    acceleration_rad_s2: float

    @staticmethod
    def of(robot: RobotConfig, names: Sequence[str]) -> "JointLimits":
        """Return the limits of a robot whose joints have ``names`` in commands."""
        return JointLimits(
            tuple(names),
            robot.name,
            np.array(robot.limit_rad),
            robot.joint_speed_limit_rad_s,
            robot.joint_acceleration_limit_rad_s2,
        )

    def numbers(self, names: Sequence[str], what: str) -> JointNumbers:
        """(K,) numbers of the named joints; ``joint0`` also names the joint next to the head.

        Raises:
            InputError: names are missing, repeated or unknown.

        """
        if not names:
            raise InputError(f"{what}: names no joint")
        if len(names) > len(self.names):
            raise InputError(
                f"{what}: names {len(names)} joints; {self.robot} has {len(self.names)}"
            )
        numbers = {name: k for k, name in enumerate(numbered_joint_names(len(self.names)))}
        numbers |= {name: k for k, name in enumerate(self.names)}
        unknown = [name for name in names if name not in numbers]
        if unknown:
            raise InputError(
                f"{what}: robot {self.robot} has no joint {unknown[0][:NAME_MAX]}; use "
                f"{self.names[0]} to {self.names[-1]}"
            )
        joints = [numbers[name] for name in names]
        if len(set(joints)) < len(joints):
            raise InputError(f"{what}: names a joint twice")
        return np.array(joints, dtype=np.intp)

    def check_angles(self, angle_rad: Floats, joints: JointNumbers, what: str) -> None:
        """Reject angles (N, K) that are not numbers, or beyond the limits of the joints (K,).

        Raises:
            InputError: names the first.

        """
        limit = self.angle_rad[joints]
        bad = ~(np.abs(angle_rad) <= limit * _SLACK)
        if not bad.any():
            return
        point, column = (int(k) for k in np.argwhere(bad)[0])
        name = self.names[joints[column]]
        value = angle_rad[point, column]
        if not np.isfinite(value):
            raise InputError(f"{what}: {name}: {value} is not a number")
        raise InputError(f"{what}: {name}: {value:.2f} rad; its limit is {limit[column]:.2f}")


def spline_through(
    trajectory: JointTrajectory, now: JointsNow, limits: JointLimits
) -> tuple[PPoly, float]:
    """Return a spline from the joints' present motion through the points, and its end, s.

    Positions alone give a cubic spline that ends at rest; velocities give a cubic, accelerations a
    quintic, from point to point.

    Raises:
        InputError: the points are malformed, or the spline exceeds a limit.

    """
    joints = limits.numbers(trajectory.joints, "trajectory")
    trajectory = _checked_trajectory(trajectory)
    limits.check_angles(trajectory.position_rad, joints, "trajectory")
    if trajectory.time_s[0] <= 0.0:
        trajectory = _without_first_point(trajectory, now.angle_rad[joints])
    spline = _spline(trajectory, joints, now)
    _check_spline(spline, limits)
    return spline, float(trajectory.time_s[-1])


def _checked_trajectory(given: JointTrajectory) -> JointTrajectory:
    """Return it as arrays, if shapes agree, values are finite and times increase."""
    time_s = np.asarray(given.time_s, dtype=float)
    values = [None if v is None else np.asarray(v, dtype=float) for v in given[2:]]
    shape = (len(time_s), len(given.joints))
    if any(value is not None and value.shape != shape for value in values):
        raise InputError(
            f"trajectory: each of its {shape[0]} points needs {shape[1]} positions, and as many "
            "velocities and accelerations, or none at all"
        )
    if not 0 < len(time_s) <= POINTS_MAX:
        raise InputError(f"trajectory: {len(time_s)} points; 1 to {POINTS_MAX} are accepted")
    if not (np.isfinite(time_s).all() and (np.diff(time_s) > 0.0).all() and time_s[0] >= 0.0):
        raise InputError("trajectory: time_from_start must grow from point to point, from 0 on")
    _, velocity, acceleration = values
    for rate in (velocity, acceleration):
        if rate is not None and not np.isfinite(rate).all():
            raise InputError("trajectory: a velocity or acceleration is not a number")
    if velocity is None and acceleration is not None:
        raise InputError("trajectory: has accelerations but no velocities; add velocities")
    if velocity is not None and np.abs(velocity[-1]).max() > _REST_SPEED_RAD_S:
        raise InputError("trajectory: the velocities of its last point must be 0")
    return JointTrajectory(given.joints, time_s, *values)  # type: ignore[arg-type]


def _without_first_point(given: JointTrajectory, angle_rad: Floats) -> JointTrajectory:
    """Drop a first point at 0 s, if the named joints (K,) are there."""
    if len(given.time_s) == 1:
        raise InputError("trajectory: its only point is at 0 s; give it a time above 0")
    away = np.abs(given.position_rad[0] - angle_rad)
    worst = int(np.argmax(away))
    if away[worst] > START_RAD:
        raise InputError(
            f"trajectory: begins at 0 s {away[worst]:.2f} rad from where {given.joints[worst]} is; "
            "leave this point out, or give it time"
        )
    return JointTrajectory(given.joints, *(None if v is None else v[1:] for v in given[1:]))  # type: ignore[arg-type]


def _spline(given: JointTrajectory, joints: JointNumbers, now: JointsNow) -> PPoly:
    knots_s = np.concatenate([[0.0], given.time_s])
    still = np.zeros(len(now.angle_rad))

    def rows(first: Floats, values: Floats, others: Floats) -> Floats:
        tile = np.tile(others, (len(knots_s), 1))
        tile[0] = first
        tile[1:, joints] = values
        return tile

    angles = rows(now.angle_rad, given.position_rad, now.angle_rad)
    if given.velocity_rad_s is None:
        return CubicSpline(knots_s, angles, bc_type=((1, now.speed_rad_s), (1, still)))
    speeds = rows(now.speed_rad_s, given.velocity_rad_s, still)
    if given.acceleration_rad_s2 is None:
        return CubicHermiteSpline(knots_s, angles, speeds)
    bends = rows(still, given.acceleration_rad_s2, still)
    return PPoly(_quintics(np.diff(knots_s)[:, None], angles, speeds, bends), knots_s)


def _quintics(h_s: Floats, q: Floats, v: Floats, a: Floats) -> Floats:
    """(6, N, J) coefficients, highest first, of quintics on pieces of length (N, 1).

    They match values, speeds and accelerations (N + 1, J) at both ends. ``scipy``'s
    ``BPoly.from_derivatives`` is a hundred times slower.
    """
    q0, v0, a0 = q[:-1], v[:-1] * h_s, a[:-1] * h_s**2
    q1 = q[1:] - q0 - v0 - 0.5 * a0
    v1, a1 = v[1:] * h_s - v0 - a0, a[1:] * h_s**2 - a0
    unit = [
        6.0 * q1 - 3.0 * v1 + 0.5 * a1,
        -15.0 * q1 + 7.0 * v1 - a1,
        10.0 * q1 - 4.0 * v1 + 0.5 * a1,
        0.5 * a0,
        v0,
        q0,
    ]
    return np.array([coefficient / h_s ** (5 - power) for power, coefficient in enumerate(unit)])


def _largest_derivative(spline: PPoly, order: int) -> Floats:
    """(J,) largest size of a derivative at ``_SAMPLES`` of each piece and at its end."""
    pieces = spline.derivative(order) if order else spline
    at_s = np.diff(spline.x)[:, None] * np.linspace(0.0, 1.0, _SAMPLES + 1)[:, None, None]
    values = np.zeros((_SAMPLES + 1, *pieces.c.shape[1:]))
    for coefficient in pieces.c:
        values = values * at_s + coefficient
    return np.asarray(np.abs(values).max(axis=(0, 1)))


def _check_spline(spline: PPoly, limits: JointLimits) -> None:
    for order, most, what, unit in (
        (0, limits.angle_rad, "bends to", "rad"),
        (1, limits.speed_rad_s, "moves at", "rad/s"),
        (2, limits.acceleration_rad_s2, "accelerates at", "rad/s2"),
    ):
        reach = _largest_derivative(spline, order)
        over = reach / most
        worst = int(np.argmax(over))
        if over[worst] > _SLACK:
            more = over[worst] ** (1.0 / order) if order else 0.0
            advice = (
                f"; give it {np.ceil(100.0 * more) / 100.0:.2f} times the time" if order else ""
            )
            raise InputError(
                f"trajectory: {limits.names[worst]} {what} {reach[worst]:.2f} {unit} between its "
                f"points; its limit is {reach[worst] / over[worst]:.2f}{advice}"
            )
