"""Metrics of a run next to those of its truth, computed by the same functions."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView, SpineLinks
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.rehearsal.judgement import clock_offset_s
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.truth import Truth
from snakewalk.controller.runtime.slip_monitor import SlipMonitor
from snakewalk.drivers.types import BodyPose

_SMOOTHING_S: Final = 0.5
"""As the loop smooths the forward speed."""


@dataclass(frozen=True, slots=True)
class MetricErrors:
    """Metrics that a run reports, and those of the truth; None where one is unknown."""

    distance_m: float | None
    true_distance_m: float | None
    cost_of_transport: float | None
    """Electrical."""
    true_cost_of_transport: float | None
    eta: float | None
    true_eta: float | None
    alarms: int
    """Slip alarms of the run."""
    true_alarms: int
    """Slip alarms that the same monitor raises on the true motion."""


def metric_errors(truth: Truth, record: RunRecord, numbers: RunSummary) -> MetricErrors | None:
    """Compare the metrics of a run with those of its truth; None without poses that date it.

    Args:
        truth: of the server.
        record: log of the run.
        numbers: its summary.

    """
    records = true_record(truth, record)
    if records is None:
        return None
    true_run, displacement_m = records
    true = summary(true_run)
    return MetricErrors(
        numbers.travelled_m,
        true.travelled_m,
        numbers.electrical_cost_of_transport,
        true.electrical_cost_of_transport,
        numbers.eta,
        true.eta,
        sum(
            event.kind == "alarm" and "predicted distance" in event.text for event in record.events
        ),
        slip_alarms(true_run, displacement_m),
    )


def true_record(truth: Truth, record: RunRecord) -> tuple[RunRecord, Floats] | None:
    """Return the record with the true poses, and the displacement (P,) of the links in each cycle.

    The links follow from the true pose of the head and the measured joints. None without datagrams
    that contain the time of the server's clock.
    """
    offset_s = clock_offset_s(truth, record)
    pose = record.pose
    if offset_s is None or len(pose.time_s) < 2:
        return None
    at_s = np.clip(pose.time_s - offset_s, truth.time_s[0], truth.time_s[-1])
    head_m = np.column_stack([np.interp(at_s, truth.time_s, axis) for axis in truth.head_m.T])
    turns = Slerp(truth.time_s, Rotation.from_matrix(truth.rotation))(at_s).as_matrix()
    return with_head_poses(record, head_m, turns)


def with_head_poses(
    record: RunRecord, head_m: Floats, rotation: Floats
) -> tuple[RunRecord, Floats]:
    """Return the record with other poses (P, 3), (P, 3, 3) of the head, as ``true_record``."""
    pose = record.pose
    cycle = record.cycle
    rows = np.clip(np.searchsorted(cycle.time_s, pose.time_s), 0, len(cycle.time_s) - 1)
    spine = SpineLinks.of(record.header.robot)
    views = [
        spine.in_world(BodyPose(0.0, head, turn), np.nan_to_num(joints))
        for head, turn, joints in zip(head_m, rotation, cycle.measured_rad[rows], strict=True)
    ]
    displacement_m = np.array([0.0, *(_advance_m(*pair) for pair in pairwise(views))])
    hz = record.header.run.cycle_hz
    speed_m_s = np.empty(len(views))
    smooth = 0.0
    for k, step_m in enumerate(displacement_m):
        smooth += min(1.0 / (_SMOOTHING_S * hz), 1.0) * (step_m * hz - smooth)
        speed_m_s[k] = smooth
    other = replace(
        pose,
        head_m=head_m,
        rotation=rotation,
        links_m=np.array([view.link_m for view in views]),
        centre_m=np.array([view.centre_m for view in views]),
        speed_m_s=speed_m_s,
    )
    return replace(record, pose=other), displacement_m


def _advance_m(before: BodyView, now: BodyView) -> float:
    return now.unbiased_advance_since_m(before)


def slip_alarms(record: RunRecord, displacement_m: Floats) -> int:
    """Return how many slip alarms the monitor of the loop raises on a motion."""
    pose = record.pose
    header = record.header
    moving = pose.pulse_m_s > 0.0
    if not moving.any():
        return 0
    gain = float(np.median(pose.predicted_speed_m_s[moving] / pose.pulse_m_s[moving]))
    monitor = SlipMonitor(header.robot.length_m, gain, header.run.safety.advance_fraction)
    steps_m = pose.pulse_m_s * record.period_s
    return sum(monitor.update(*step) for step in zip(steps_m, displacement_m, strict=True))
