"""Slope of the ground under the body over time."""

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, BLUE, GREY
from snakewalk.controller.figures.style import (
    canvas,
    label_time,
    legend_above,
    mark_waypoints,
    trace,
)
from snakewalk.controller.metrics.ground_slope import ground_slope
from snakewalk.controller.metrics.path_error import waypoint_times_s
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord


def slope_figure(record: RunRecord) -> Figure | None:
    """Draw the slope under the body, and where the walk rides on wide waves; None if level."""
    pose = record.pose
    header = record.header
    walk = record.walk
    if header.ground is None or len(pose.time_s) < 2:
        return None
    ground = header.ground
    slopes = by_rows(lambda links_m: np.stack(ground_slope(ground, links_m), axis=1), pose.links_m)
    ahead_rad, steepest_rad = slopes.T
    figure, panels = canvas(1, 2.8)
    axes = panels[0]
    trace(axes, pose.time_s, np.rad2deg(steepest_rad), AMBER, "steepest")
    trace(axes, pose.time_s, np.rad2deg(ahead_rad), BLUE, "ahead, uphill positive")
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    is_wide = walk.carrier_rad > 0.0
    if is_wide.any():
        axes.fill_between(
            np.append(walk.time_s, record.end_s),
            0.0,
            1.0,
            where=np.append(is_wide, is_wide[-1:]),
            step="post",
            color=GREY,
            alpha=0.25,
            linewidth=0.0,
            transform=axes.get_xaxis_transform(),
            label="walk on wide waves",
        )
    axes.set_ylabel("slope (degrees)")
    label_time(axes, record.end_s)
    legend_above(axes)
    times_s = waypoint_times_s(pose, header.plan)
    mark_waypoints(panels, times_s, measured=header.pose_evidence.is_measured)
    return figure
