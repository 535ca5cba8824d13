"""Failure of a run along waypoints: its cause, from its log."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.metrics.ground_contact import roll_rad
from snakewalk.controller.metrics.path_error import length_m, path_error_m, waypoint_times_s
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.terrain.climb import CLIMBED_RAD

Cause = Literal["safety", "roll", "joint", "slip", "climb", "steering", "time"]

ROLL_LIMIT_RAD = np.radians(60.0)
"""Roll of the head link beyond which the body counts as rolled over (ours)."""
WINDOW_S = 30.0
"""Duration of the end of a run that is judged (ours): several body lengths of travel."""
CLAMP_SHARE = 0.2
"""Share of cycles with a clamped goal from which on the joints do not follow (ours)."""
PROGRESS_SHARE = 0.5
"""Progress along the path over advance of the body, below which it goes elsewhere (ours)."""

SLID_SHARE = 0.5
"""Slide over the advance of the links, above which they slip: at least 0.65 on ice and steep
planes until the first new path, at most 0.36 where a body goes astray (ours)."""
SLID_BODIES = 0.5
"""Slide or advance, in lengths of the body, that leads it off its path (ours)."""


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a run did not reach every waypoint."""

    cause: Cause
    """The first that applies (``docs/failures.md`` lists them in this order)."""
    text: str
    """Description of the failure, with the numbers that show it."""


def failure(record: RunRecord) -> Failure | None:
    """Return what ended a run; None if it reached every waypoint, or had none, without a trip.

    All but trip, roll and the limit is judged over the last ``WINDOW_S`` seconds.
    """
    plan = record.header.plan
    pose = record.pose
    trip = next((event.text for event in record.events if event.kind == "trip"), None)
    if trip is not None:
        return Failure("safety", f"stopped by safety: {trip}")
    if len(waypoint_times_s(pose, plan)) == len(plan.waypoints_m):
        return None
    roll = np.abs(by_rows(roll_rad, pose.rotation))
    # of a gait no pulse is known
    walks = (pose.pulse_m_s > 0.0) | (record.header.run.gait is not None)
    over = np.flatnonzero((roll > ROLL_LIMIT_RAD) & walks)  # rolling uphill does not count
    if len(over):
        return Failure(
            "roll",
            f"rolled over after {pose.time_s[over[0]]:.0f} s, "
            f"up to {np.degrees(roll.max()):.0f} deg{_slope_text(record, over[0])}",
        )
    limit_s = record.header.run.time_limit_s
    speed_m_s = plan.predicted_speed_m_s
    way_m = length_m(plan.path_m) - plan.waypoint_radius_m
    if way_m > speed_m_s * limit_s > 0.0:  # no body that does what was planned comes to the end
        return Failure(
            "time",
            f"its path needs {way_m / speed_m_s:.0f} s at the {speed_m_s:.2f} m/s of the plan; "
            f"time_limit_s is {limit_s:g}",
        )
    clamped = np.array(record.cycle.verdict, str) == "clamp"
    clamped = clamped[record.cycle.time_s >= record.end_s - WINDOW_S]
    if len(clamped) and clamped.mean() > CLAMP_SHARE:
        return Failure("joint", f"joints do not follow: {clamped.mean():.0%} of goals clamped")
    rows = np.flatnonzero((pose.time_s >= record.end_s - WINDOW_S) & walks)
    if len(rows) < 2:
        return Failure("joint", "the shape did not travel along the body")
    return _of_advance(record, rows)


def _slope_text(record: RunRecord, row: int) -> str:
    """Return the slope under a body that rolled over, where it is steeper than friction holds."""
    ground = record.header.ground
    if ground is None:
        return ""
    slope_rad = np.median(ground.slope_rad(*record.pose.links_m[row, :, :2].T))
    if slope_rad <= max(_holds_rad(record), CLIMBED_RAD):
        return ""
    return f", on a slope of {np.degrees(slope_rad):.0f} deg"


def _of_advance(record: RunRecord, rows: np.ndarray) -> Failure:
    """Judge the rows (n,) of the pose in which the shape travels."""
    pose = record.pose
    header = record.header
    friction = record.friction
    across = header.world.friction.across
    if len(friction.time_s) and friction.across_95[-1, 1] < across:
        low, high = friction.across_95[-1]
        return Failure(
            "slip",
            f"friction across the body is {friction.across[-1]:.2g} ({low:.2g} to {high:.2g}), "
            f"in the file {across:g}",
        )
    replanned_s = record.paths[1][0] if len(record.paths) > 1 else np.inf
    first = np.flatnonzero(pose.time_s < replanned_s)
    first = first if len(first) > 1 else rows
    share, travelled, progress = _advance(record, rows)
    text = f"moved {travelled:.1f} m, {max(progress, 0.0):.1f} m of it along the path"
    ahead_m = np.linspace(0.0, header.robot.length_m, 5)
    steep_rad = _steepest_rad(record, -1, np.median(pose.path_s_m[rows]) + ahead_m)
    climb = None
    if steep_rad > max(_holds_rad(record), CLIMBED_RAD):
        climb = _of_climb(
            record, first, f"{text}, which climbs by {np.degrees(steep_rad):.0f} deg there"
        )
    place_m = np.ptp(pose.centre_m[rows, :2], axis=0)
    if climb and np.hypot(*place_m) < PROGRESS_SHARE * travelled:  # it turns before the slope
        return climb
    for part in (first, rows):
        if astray := _astray(record, part):
            return Failure("steering", astray)
    if share < header.run.safety.advance_fraction:
        x, y, z = np.moveaxis(pose.links_m[rows, 0] - pose.links_m[rows, -1], -1, 0)
        up_rad = np.arctan2(z, np.hypot(x, y)).mean()  # of the line from tail to head
        said = f"advanced {share:.0%} of the prediction"
        if up_rad <= _holds_rad(record):
            return Failure("slip", f"{said}, no steep climb")
        return _of_climb(record, first, f"{said}, {np.degrees(up_rad):.0f} deg uphill")
    if progress >= PROGRESS_SHARE * travelled:
        left_m = length_m(record.paths[-1][1]) - pose.path_s_m[-1]
        late = f"out of time with {left_m:.1f} m of path left"
        slowed = [event.text for event in record.events if event.kind == "derating"]
        return Failure("joint", f"{late}; {slowed[0]}") if slowed else Failure("time", late)
    if climb:
        return climb
    slid_m, fall_rad = _slide(record, rows)
    falls = f"where the ground falls by {np.degrees(fall_rad):.0f} deg"
    return Failure("slip", f"{text}, and slid {slid_m:.1f} m {falls}")


def _advance(record: RunRecord, rows: np.ndarray) -> tuple[float, float, float]:
    """Share of the predicted advance of the links, their advance, and that along the paths, m."""
    pose = record.pose
    advanced = pose.speed_m_s[rows].mean()
    predicted = pose.predicted_speed_m_s[rows].mean()
    share = advanced / predicted if predicted > 0.0 else 1.0
    path = np.searchsorted([since_s for since_s, _ in record.paths], pose.time_s[rows], "right")
    progress = np.diff(pose.path_s_m[rows])[np.diff(path) == 0].sum()
    return share, advanced * np.ptp(pose.time_s[rows]), progress


def _astray(record: RunRecord, rows: np.ndarray) -> str | None:
    """Describe a body that advanced without slip, but not along its path; None for others."""
    _, travelled, progress = _advance(record, rows)
    if (
        travelled < SLID_BODIES * record.header.robot.length_m
        or progress >= PROGRESS_SHARE * travelled
        or _slide(record, rows)[0] >= SLID_SHARE * travelled
    ):
        return None
    return (
        f"advanced {travelled:.1f} m, {max(progress, 0.0):.1f} m of it along the path; "
        f"up to {np.nanmax(path_error_m(record)[rows]):.2f} m off it"
    )


def _of_climb(record: RunRecord, rows: np.ndarray, text: str) -> Failure:
    """Return a climb, or the slide that led a body off its first path, which does not climb.

    ``rows`` (n,) of the pose are those before the first new path.
    """
    body_m = record.header.robot.length_m
    due_m = np.arange(0.0, length_m(record.header.plan.path_m), 0.25 * body_m)
    slid_m, fall_rad = _slide(record, rows)
    if (
        _steepest_rad(record, 0, due_m) <= max(_holds_rad(record), CLIMBED_RAD)
        and slid_m > SLID_BODIES * body_m
    ):
        return Failure(
            "slip",
            f"slid {slid_m:.1f} m down a slope of {np.degrees(fall_rad):.0f} deg off its path, "
            f"and did not come back: {text}",
        )
    return Failure("climb", text)


def _slide(record: RunRecord, rows: np.ndarray) -> tuple[float, float]:
    """Distance that the body moved across itself, and slope of the ground in this direction.

    The slope is the mean under the body's centre, over a quarter of its length in the direction of
    the slide; 0 without a ground.
    """
    pose = record.pose
    along = pose.links_m[rows, 0, :2] - pose.links_m[rows, -1, :2]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    speed_m_s = pose.speed_m_s[rows, None] * along
    steps_s = np.diff(pose.time_s[rows])[:, None]
    centre_m = pose.centre_m[rows, :2]
    slide_m = centre_m[-1] - centre_m[0] - (speed_m_s[:-1] * steps_s).sum(axis=0)
    slid_m = float(np.linalg.norm(slide_m))
    ground = record.header.ground
    if ground is None or slid_m < 1e-6:
        return slid_m, 0.0
    half_m = 0.125 * record.header.robot.length_m
    ahead_m, behind_m = (centre_m + sign * half_m * slide_m / slid_m for sign in (1.0, -1.0))
    fall_m = ground.elevation_m(*behind_m.T) - ground.elevation_m(*ahead_m.T)
    return slid_m, np.arctan(fall_m.mean() / (2.0 * half_m))


def _steepest_rad(record: RunRecord, which: int, due_m: Floats) -> float:
    """Steepest inclination of a path between arc lengths (n,), uphill positive.

    0 without a ground or a path.
    """
    ground = record.header.ground
    if ground is None or not record.paths or not np.isfinite(due_m).all():
        return 0.0
    path_m = record.paths[which][1][:, :2]
    at_m = arc_lengths(path_m)
    due_m = np.clip(due_m, 0.0, at_m[-1])
    x, y = (np.interp(due_m, at_m, path_m[:, axis]) for axis in range(2))
    steps_m = np.diff(due_m)
    rises_m = np.diff(ground.elevation_m(x, y))
    is_known = steps_m > 1e-6
    return float(np.arctan(rises_m[is_known] / steps_m[is_known]).max(initial=0.0))


def _holds_rad(record: RunRecord) -> float:
    """Slope on which a straight body just does not slide back along itself."""
    return float(np.arctan(record.header.world.friction.along))
