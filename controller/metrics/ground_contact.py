"""Contact of the body with the ground: largest roll, links in the air, by pose and by current."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.mechanics.support import lifted, support_n
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose

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
    pitch joints, torque constant or poses. ``docs/benchmarks/compliance.md`` states its accuracy.
    """
    header = record.header
    pose = record.pose
    cycle = record.cycle
    robot = header.robot
    k_t = header.torque_constant_n_m_a
    is_known = np.isfinite(pose.head_m).all(axis=1) & np.isfinite(pose.rotation).all(axis=(1, 2))
    rows = np.flatnonzero(is_known)[::EVERY]
    if not robot.pitch_joints or not np.isfinite(k_t) or not len(rows):
        return float("nan")
    index = np.searchsorted(cycle.time_s, pose.time_s[rows])
    inside = index < len(cycle.time_s)
    rows = rows[inside]
    index = index[inside]
    read = np.isfinite(cycle.current_a[index]).all(axis=1)
    shares = []
    for row, k in zip(rows[read], index[read], strict=True):
        head = BodyPose(float(pose.time_s[row]), pose.head_m[row], pose.rotation[row])
        body = body_in_world(robot, head, cycle.measured_rad[k])
        bears_n = support_n(robot, body, k_t * cycle.current_a[k])
        shares.append(float(lifted(robot, bears_n).mean()))
    return float(np.mean(shares)) if shares else float("nan")


def roll_rad(rotation: Floats) -> Floats:
    """Roll (n,) of a link about its own axis, from -pi to pi, by its frames (n, 3, 3)."""
    return np.asarray(np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2]))
