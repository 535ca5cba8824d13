"""Displacement of the body in a gait cycle, from the log, in the frame of the virtual chassis."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.virtual_chassis import virtual_chassis
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.stop_profile import STOP_S
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord

SKIPPED_S = 1.5
"""Time after the ramp that is skipped: the gait comes up to speed and the body into its shape."""


@dataclass(frozen=True, slots=True)
class GaitDisplacement:
    """Means over whole cycles at full rate; NaN where the log holds none."""

    cycles: int
    frequency_hz: float
    forward_bl: float
    """Body lengths a cycle along the virtual chassis, towards the head."""
    left_bl: float
    turn_rad: float
    """A cycle, positive to the left."""
    speed_m_s: float
    """Along the axis of the gait: over the ground, or upwards if the gait climbs."""
    up_bl: float = float("nan")
    """Body lengths a cycle."""
    start_s: float = float("nan")
    """Begin of the first of the cycles."""
    end_s: float = float("nan")
    """End of the last cycle."""

    @property
    def distance_m(self) -> float:
        """Along the axis of the gait, in all cycles."""
        return self.speed_m_s * (self.end_s - self.start_s)


def full_rate_span_s(start_s: float, end_s: float, duration_s: float) -> tuple[float, float]:
    """Times between which a motion runs at full rate that comes to rest after ``duration_s``.

    Its log is from ``start_s`` to ``end_s``.
    """
    last_s = end_s - STOP_S
    return max(last_s - duration_s + SKIPPED_S, start_s), last_s


def gait_displacement(record: RunRecord) -> GaitDisplacement:
    """Return the displacement of a gait run whose parameters did not change.

    Raises:
        InputError: the log is of another motion.

    """
    config = record.header.run.gait
    robot = record.header.robot
    pose = record.pose
    if config is None:
        raise InputError("the log is of no gait")
    gait = make_gait(config.name, config.parameters)
    hz = GaitCycle(gait, robot).frequency_hz
    unknown = GaitDisplacement(0, hz, *(float("nan"),) * 4)
    is_known = by_rows(lambda links_m: np.isfinite(links_m).all(axis=(1, 2)), pose.links_m)
    if not is_known.any() or hz <= 0.0:
        return unknown
    rows = np.flatnonzero(is_known)
    time_s = pose.time_s[rows]
    first_s, last_s = full_rate_span_s(float(time_s[0]), float(time_s[-1]), config.duration_s)
    count = int((last_s - first_s) * hz + 1e-9)
    if count < 1:
        return unknown
    frames: list[Frame] = []
    marks: list[Frame] = []
    marked_s: list[float] = []
    due = last_s - np.arange(count, -1, -1) / hz
    for k in range(int(np.searchsorted(time_s, due[0])), len(time_s)):
        up = pose.rotation[rows[k]][:, 2]
        frames = [virtual_chassis(pose.links_m[rows[k]], up, frames[0] if frames else None)]
        if len(marks) <= count and time_s[k] >= due[len(marks)] - 1e-9:
            marks.append(frames[0])
            marked_s.append(float(time_s[k]))
    count = len(marks) - 1
    centre = np.array([mark.origin_m[:2] for mark in marks])
    heading = np.unwrap([mark.heading_rad for mark in marks])
    middle = 0.5 * (heading[1:] + heading[:-1])
    dx, dy = np.diff(centre, axis=0).T
    forward = np.cos(middle) * dx + np.sin(middle) * dy
    left = -np.sin(middle) * dx + np.cos(middle) * dy
    rise_m = float(marks[-1].origin_m[2] - marks[0].origin_m[2]) / count
    advance_m = rise_m if gait.aim == "climb" else float(np.hypot(forward.mean(), left.mean()))
    return GaitDisplacement(
        count,
        hz,
        float(forward.mean()) / robot.length_m,
        float(left.mean()) / robot.length_m,
        float((heading[-1] - heading[0]) / count),
        advance_m * count / (marked_s[-1] - marked_s[0]),
        rise_m / robot.length_m,
        marked_s[0],
        marked_s[-1],
    )
