"""Contact of the body with the ground during a run: largest roll, share of links in the air."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.runlog.record import RunRecord

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
    rest = np.zeros_like(z)
    if ground is not None:
        gx, gy = ground.gradient(x, y)
        # a ball on a slope touches uphill of its centre
        lean = record.header.robot.body_radius_m * (np.sqrt(1.0 + gx**2 + gy**2) - 1.0)
        rest = ground.elevation_m(x, y) + lean
    gap = z - rest - record.header.robot.body_radius_m
    roll = np.abs(roll_rad(pose.rotation))
    return GroundContact(float(roll.max()), float((gap > CLEAR_M).mean()))


def roll_rad(rotation: Floats) -> Floats:
    """Roll (n,) of a link about its own axis, from -pi to pi, by its frames (n, 3, 3)."""
    return np.asarray(np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2]))
