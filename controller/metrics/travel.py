"""Travel: the displacement that speed and cost of transport of a run are computed from."""

from dataclasses import dataclass

import numpy as np

from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.metrics.displacement import (
    GaitDisplacement,
    full_rate_span_s,
    gait_displacement,
)
from snakewalk.controller.metrics.path_error import travelled_m
from snakewalk.controller.runlog.record import RunRecord


@dataclass(frozen=True, slots=True)
class Travel:
    """Displacement of the centre of mass between two times; NaN if the log lacks it."""

    distance_m: float
    """Along the path, or along the axis of the gait; negative for a climber that falls."""
    start_s: float
    end_s: float
    gait: GaitDisplacement | None = None
    """Displacement in a cycle, if it was computed."""

    @property
    def speed_m_s(self) -> float:
        """Distance over time."""
        span_s = self.end_s - self.start_s
        return self.distance_m / span_s if span_s > 0.0 else float("nan")


UNKNOWN = Travel(float("nan"), float("nan"), float("nan"))


def travel(record: RunRecord) -> Travel:
    """Return how far the centre of mass went along what the run was for.

    - On a way to waypoints: along its track, while the shape travels along the body.
    - One gait that nobody changed: along its axis, in whole cycles at full rate. The axis of a
      climber is the vertical, that of another gait goes with the virtual chassis.
    - Other motions: along the straight line between the ends, for gaits at full rate.
    """
    pose = record.pose
    gait = record.header.run.gait
    moving = np.flatnonzero(pose.pulse_m_s > 0.0)
    rows = moving if len(moving) else np.arange(len(pose.time_s))
    if len(record.header.plan.waypoints_m):
        if len(rows) < 2:
            return UNKNOWN
        first, last = int(rows[0]), int(rows[-1])
        return Travel(travelled_m(pose, first, last), *_times(record, first, last))
    climbs = gait is not None and make_gait(gait.name, gait.parameters).aim == "climb"
    if (
        gait is not None
        and not gait.then
        and not any(event.kind in {"operator", "command"} for event in record.events)
    ):
        moved = gait_displacement(record)
        if moved.cycles:
            return Travel(moved.distance_m, moved.start_s, moved.end_s, moved)
    if gait is not None and len(pose.time_s):
        ends = full_rate_span_s(float(pose.time_s[0]), float(pose.time_s[-1]), gait.duration_s)
        rows = np.flatnonzero((pose.time_s >= ends[0]) & (pose.time_s <= ends[1]))
    rows = rows[np.isfinite(pose.centre_m[rows]).all(axis=1)]
    if len(rows) < 2:
        return UNKNOWN
    first, last = int(rows[0]), int(rows[-1])
    moved_m = pose.centre_m[last] - pose.centre_m[first]
    distance_m = moved_m[2] if climbs else np.linalg.norm(moved_m)
    return Travel(float(distance_m), *_times(record, first, last))


def _times(record: RunRecord, first: int, last: int) -> tuple[float, float]:
    return float(record.pose.time_s[first]), float(record.pose.time_s[last])
