"""Measured and predicted speed, and the distance from the path."""

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import ASKED, GOAL, GREY, MEASURED
from snakewalk.controller.figures.style import canvas, legend_above, mark_waypoints, trace
from snakewalk.controller.metrics.path_error import path_error_m, waypoint_times_s
from snakewalk.controller.runlog.record import RunRecord


def advance_figure(record: RunRecord) -> Figure | None:
    """Speed and path error over time; None without a pose."""
    pose = record.pose
    if len(pose.time_s) == 0:
        return None
    distance = path_error_m(record)
    on_path = bool(np.isfinite(distance).any())
    figure, panels = canvas(2 if on_path else 1, 5.2 if on_path else 3.0)
    speed = panels[0]
    measured = "simulated" if record.header.backend == "sim" else "measured"
    for values, colour, label in (
        (pose.pulse_m_s, ASKED, "pulse speed u"),
        (pose.predicted_speed_m_s, GOAL, "predicted"),
        (pose.speed_m_s, MEASURED, measured),
    ):
        if np.isfinite(values).any():
            trace(speed, pose.time_s, values, colour, label)
    speed.set_ylabel("speed (m/s)")
    shown = np.concatenate([[0.0], pose.pulse_m_s, pose.predicted_speed_m_s, pose.speed_m_s])
    low, high = float(np.nanmin(shown)), max(float(np.nanmax(shown)), 0.01)
    speed.set_ylim(1.1 * low, 1.18 * high)
    speed.set_title("Forward speed")
    if speed.get_legend_handles_labels()[0]:
        legend_above(speed)
    if on_path:
        error = panels[1]
        trace(error, pose.time_s, distance, MEASURED, "distance")
        mean = float(np.nanmean(distance))
        error.axhline(
            mean, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), label=f"mean {mean:.3f} m"
        )
        legend_above(error)
        error.set_ylabel("distance (m)")
        error.set_ylim(bottom=0.0)
        error.set_title("Centre of mass from the path")
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, max(record.end_s, 1e-3))
    header = record.header
    mark_waypoints(
        panels, waypoint_times_s(pose, header.plan), measured=header.pose_evidence.is_measured
    )
    return figure
