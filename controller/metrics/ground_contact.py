"""Contact of the body with the ground: largest roll, links in the air, by pose and by current.

Support: weight that the ground bears under each link, from the torque of the joints.

Quasi-static, with vertical support forces: weight, support and the joint's torque balance on the
body behind each pitch joint. The torques are linear in the support; the whole body adds three
equations. Links outnumber equations, but the ground only pushes. Non-negative least squares (C. L.
Lawson, R. J. Hanson, Solving Least Squares Problems, 1974) finds the few links that bear.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its modules load when they are first used: optimize needs 0.3 s

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import (
    BodyView,
    body_in_world,
    chain_axes,
    chain_points_m,
    link_weights,
)
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose

TORQUE_NOISE_N_M = 0.005
"""Error of a torque against which an even load weighs: two units of Present Current (ours)."""
LIFTED_SHARE = 0.1
"""A link that bears less than this share of its weight is taken to be lifted (ours)."""


def support_n(robot: RobotConfig, body: BodyView, torque_n_m: Floats) -> Floats:
    """Vertical force (L,) of the ground on each link, 0 or more.

    Args:
        robot: links and joints.
        body: poses of the links.
        torque_n_m: (J,) of the servos; only pitch joints are used.

    """
    links = robot.joint_count + 1
    weight_n = robot.mean_link_mass_kg * GRAVITY_M_S2
    share = link_weights(robot)
    joints_m = chain_points_m(robot, body)[1:-1]
    axes = chain_axes(robot, body)
    pitch = np.array(robot.pitch_joints, dtype=int)
    # lever (P, L): moment about a joint's axis of an upward unit force on a link behind it
    arm_m = body.link_m[None] - joints_m[pitch, None]
    lever_m = axes[pitch, None, 0] * arm_m[..., 1] - axes[pitch, None, 1] * arm_m[..., 0]
    lever_m = np.where(np.arange(links) > pitch[:, None], lever_m, 0.0)
    middle_m = body.link_m - body.centre_m
    profile = np.stack([np.full(links, robot.mean_link_length_m), middle_m[:, 0], middle_m[:, 1]])
    even = np.eye(links) * (TORQUE_NOISE_N_M / weight_n)
    rows = np.concatenate([lever_m, profile, even])
    target = (rows * share).sum(axis=1) * weight_n
    target[: len(pitch)] -= torque_n_m[pitch]
    return scipy.optimize.nnls(rows, target)[0]


def lifted(robot: RobotConfig, bears_n: Floats) -> Bools:
    """Whether each link is lifted, from the supporting force; any shape."""
    weight_n = robot.mean_link_mass_kg * link_weights(robot) * GRAVITY_M_S2
    return bears_n < LIFTED_SHARE * weight_n


EVERY = 5
"""Cycles from one look at the currents to the next."""
CLEAR_M = 0.005
"""A link this far above where it would rest is counted as in the air."""


@dataclass(frozen=True, slots=True)
class GroundContact:
    """Over all cycles of a run."""

    roll_max_rad: float
    """Largest roll of the head link to a side; pi upside down."""
    in_air: float
    """Share of links in the air, mean."""


def ground_contact(record: RunRecord, ground: HeightField | None) -> GroundContact:
    """Return the ground contact over a run's poses; NaN where the log has none."""
    pose = record.pose
    if len(pose.time_s) == 0 or not np.isfinite(pose.links_m).all():
        return GroundContact(float("nan"), float("nan"))
    x, y, z = np.moveaxis(pose.links_m, -1, 0)
    robot = record.header.robot
    rest = np.zeros_like(z)
    radius_m = np.array(robot.link_radii_m)
    if ground is not None:
        gx, gy = ground.gradient(x, y)
        # a ball on a slope touches uphill of its centre
        lean = radius_m * (np.sqrt(1.0 + gx**2 + gy**2) - 1.0)
        rest = ground.elevation_m(x, y) + lean
    gap = (z - rest - radius_m)[:, [shape != "none" for shape in robot.link_shapes]]
    roll = np.abs(roll_rad(pose.rotation))
    return GroundContact(float(roll.max()), float((gap > CLEAR_M).mean()))


def lifted_by_current(record: RunRecord) -> float:
    """Return the mean share of lifted links, from the pitch joints' currents.

    It uses the pose only for the directions of the joints, and does not use the ground. NaN without
    pitch joints, torque constant or poses. ``docs/compliance.md`` states its accuracy.
    """
    header = record.header
    pose = record.pose
    cycle = record.cycle
    robot = header.robot
    k_t = header.torque_constant_n_m_a
    is_known = by_rows(_are_finite, pose.head_m) & by_rows(_are_finite, pose.rotation)
    rows = np.flatnonzero(is_known)[::EVERY]
    if not robot.pitch_joints or not np.isfinite(k_t) or not len(rows):
        return float("nan")
    index = np.searchsorted(cycle.time_s, pose.time_s[rows])
    inside = index < len(cycle.time_s)
    rows = rows[inside]
    index = index[inside]
    read = by_rows(_are_finite, cycle.current_a)[index]
    shares = []
    for row, k in zip(rows[read], index[read], strict=True):
        head = BodyPose(float(pose.time_s[row]), pose.head_m[row], pose.rotation[row])
        body = body_in_world(robot, head, cycle.measured_rad[k])
        bears_n = support_n(robot, body, k_t * cycle.current_a[k])
        shares.append(float(lifted(robot, bears_n).mean()))
    return float(np.mean(shares)) if shares else float("nan")


def _are_finite(rows: Floats) -> Bools:
    return np.asarray(np.isfinite(rows).all(axis=tuple(range(1, rows.ndim))))


def roll_rad(rotation: Floats) -> Floats:
    """Roll (n,) of a link about its own axis, from -pi to pi, by its frames (n, 3, 3)."""
    return np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
