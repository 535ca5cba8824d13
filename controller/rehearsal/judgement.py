"""Judgement of a run on a served robot by the truth of the server."""

from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.metrics.path_error import distance_m, waypoint_times_s
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.verdict import verdict
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.evidence import Kind
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.truth import Truth

LEAST_SD_M = 0.01
"""Accuracy of a pose that states none (ours)."""
SD = 2.0
"""Standard deviations by which a waypoint may be farther than its radius."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """A run compared with the truth."""

    waypoints: int
    claimed: int
    """Waypoints that the run says it reached; 0 if it says that its pose is unconfirmed."""
    truly_reached: int
    """Waypoints that the body truly came to, in order, within their radius and 2 cm."""
    reached_as_stated: int
    """Waypoints truly reached within their radius and the accuracy that the run states."""
    closest_m: tuple[float, ...]
    """Least distance of the true body from each waypoint, after the waypoint before."""
    verdict: str
    """End of the run according to its own log."""
    tripped: str | None
    path_error_mean_m: float | None
    """Distance of the true body from the path."""
    path_error_max_m: float | None
    pose_error_rms_m: float | None
    """Distance of the run's head from the true one; None without datagrams that date it."""
    pose_error_max_m: float | None
    heading_error_rms_deg: float | None
    travelled_m: float
    """Length of the true way of the body, with its steps of 0.1 s and less left out."""

    @property
    def has_arrived(self) -> bool:
        """Whether the body truly came to every waypoint, without a trip."""
        return self.truly_reached == self.waypoints and self.tripped is None

    @property
    def is_true(self) -> bool:
        """Whether the run claims no waypoint that the body did not come to, as it states."""
        return self.claimed <= self.reached_as_stated

    @property
    def text(self) -> str:
        """One line for a reader."""
        said = f"the body truly came to {self.truly_reached} of {self.waypoints} waypoints"
        claim = f"the run claims {self.claimed}"
        if self.claimed <= self.truly_reached:
            return f"{said}; {claim}"
        return f"{said}; {claim}: that is " + ("within its accuracy" if self.is_true else "false")

    def facts(self) -> dict[str, Any]:
        """Return the judgement for a command's answer."""
        return {
            **asdict(self),
            "closest_m": list(self.closest_m),
            "has_arrived": self.has_arrived,
            "is_true": self.is_true,
        }


def judge(
    truth: Truth,
    record: RunRecord,
    numbers: RunSummary,
) -> Judgement:
    """Compare a run with the truth of the robot that was served.

    Args:
        truth: of the server.
        record: log of the run.
        numbers: its summary.

    """
    plan = record.header.plan
    is_unconfirmed = numbers.pose_evidence == Kind.UNCONFIRMED
    near_m = plan.waypoint_radius_m + SD * LEAST_SD_M
    stated_m = plan.waypoint_radius_m + SD * max(numbers.pose_position_sd_m or 0.0, LEAST_SD_M)
    track_m = truth.centre_m[:, :2]
    reached, closest = true_arrivals(track_m, plan.waypoints_m, near_m)
    coarse_m = truth.centre_m[:: _stride(truth), :2].copy()
    off_path_m = _off_path_m(coarse_m, record)
    head_m, heading_rad = pose_errors(truth, record)
    return Judgement(
        waypoints=len(plan.waypoints_m),
        claimed=0 if is_unconfirmed else len(waypoint_times_s(record.pose, plan)),
        truly_reached=reached,
        reached_as_stated=true_arrivals(track_m, plan.waypoints_m, stated_m)[0],
        closest_m=tuple(round(float(value), 3) for value in closest),
        verdict=verdict(record, numbers).with_cause,
        tripped=numbers.trip,
        path_error_mean_m=(round(float(off_path_m.mean()), 4) if off_path_m.size else None),
        path_error_max_m=_largest_value(off_path_m),
        pose_error_rms_m=_rms(head_m),
        pose_error_max_m=_largest_value(head_m),
        heading_error_rms_deg=_rms(np.degrees(heading_rad)),
        travelled_m=round(float(np.hypot(*np.diff(coarse_m, axis=0).T).sum()), 3),
    )


def true_arrivals(
    centre_m: Floats, waypoints_m: Floats, radius_m: float
) -> tuple[int, list[float]]:
    """Return the waypoints (w, 2) that a way (n, 2) comes to in order, and least distances."""
    first = 0
    reached = 0
    closest = []
    for waypoint_m in waypoints_m:
        away_m = by_rows(partial(_distances_m, waypoint_m), centre_m[first:])
        closest.append(float(away_m.min()) if len(away_m) else np.inf)
        within = np.flatnonzero(away_m <= radius_m)
        if reached < len(closest) - 1:
            continue
        if len(within):
            reached += 1
            first += int(within[0])
    return reached, closest


def pose_errors(truth: Truth, record: RunRecord) -> tuple[Floats, Floats]:
    """Return how far the run's head was off in position (n,) and heading (n,).

    The clocks are compared by the datagrams: the quickest one arrives when the server sent it.
    """
    pose = record.pose
    offset_s = clock_offset_s(truth, record)
    if offset_s is None:
        return np.zeros(0), np.zeros(0)
    at_s = pose.time_s - offset_s
    within = (at_s >= truth.time_s[0]) & (at_s <= truth.time_s[-1])
    at_s = at_s[within]
    true_m = np.stack([np.interp(at_s, truth.time_s, truth.head_m[:, k]) for k in range(2)], 1)
    true_rad = np.interp(at_s, truth.time_s, np.unwrap(by_rows(_heading_rad, truth.rotation)))
    turn = by_rows(_heading_rad, pose.rotation)[within] - true_rad
    return (
        np.hypot(*(pose.head_m[:, :2][within] - true_m).T),
        np.abs(np.angle(np.exp(1j * turn))),
    )


def _distances_m(place_m: Floats, track_m: Floats) -> Floats:
    return np.asarray(np.hypot(*(track_m - place_m).T))


def _heading_rad(rotation: Floats) -> Floats:
    return np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])


def clock_offset_s(truth: Truth, record: RunRecord) -> float | None:
    """Return the run's time less the server's; None without datagrams that contain it."""
    source = record.pose_source
    if not len(source.time_s):
        return None
    rows = np.searchsorted(truth.sequence, source.sequence, side="right") - 1
    is_known = (truth.sequence[rows] == source.sequence) & np.isfinite(source.arrival_s)
    is_known[is_known] = np.isfinite(truth.sent_s[rows[is_known]])
    if not is_known.any():
        return None
    return float((source.arrival_s[is_known] - truth.sent_s[rows[is_known]]).min())


def _off_path_m(centre_m: Floats, record: RunRecord) -> Floats:
    """Distance (n,) of the true body (n, 2) from the nearest of the run's paths."""
    unknown_along_m = np.full(len(centre_m), np.nan)
    off = [distance_m(centre_m, path_m[:, :2], unknown_along_m) for _, path_m in record.paths]
    return np.asarray(np.min(off, axis=0))


def _stride(truth: Truth) -> int:
    """Rows in 0.1 s."""
    if len(truth.time_s) < 2:
        return 1
    period_s = (truth.time_s[-1] - truth.time_s[0]) / (len(truth.time_s) - 1)
    return max(round(0.1 / float(period_s)), 1)


def _largest_value(values: Floats) -> float | None:
    return round(float(values.max()), 4) if values.size else None


def _rms(values: Floats) -> float | None:
    return round(float(np.sqrt(np.mean(values * values))), 4) if values.size else None
