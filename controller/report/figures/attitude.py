"""Readings of the robot's IMU: roll, pitch and heading of its link, and how fast it turned."""

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, BLUE, GREEN, GREY
from snakewalk.controller.figures.style import canvas, label_time, legend_above, trace
from snakewalk.controller.runlog.record import RunRecord


def attitude_figure(record: RunRecord) -> Figure | None:
    """Angles over rates; None without an IMU."""
    imu = record.imu
    if len(imu.time_s) < 2:
        return None
    figure, (angles, rates) = canvas(2, 4.4)
    turn = imu.rotation
    roll = np.arctan2(turn[:, 2, 1], turn[:, 2, 2])
    pitch = np.arcsin(np.clip(turn[:, 2, 0], -1.0, 1.0))
    heading = np.unwrap(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))
    named = (("roll", roll, BLUE), ("pitch, nose up", pitch, GREEN), ("heading", heading, AMBER))
    for label, angle, colour in named:
        trace(angles, imu.time_s, np.rad2deg(angle), colour, label)
    angles.axhline(0.0, color=GREY, linewidth=0.8)
    angles.set_ylabel("angle (degrees)")
    legend_above(angles)
    axes = zip(("forward", "left", "up"), (BLUE, GREEN, AMBER), strict=True)
    for k, (label, colour) in enumerate(axes):
        rate_dps = np.rad2deg(imu.rate_rad_s[:, k])
        trace(rates, imu.time_s, rate_dps, colour, f"about {label}")
    rates.set_ylabel("rate (degrees/s)")
    label_time(rates, record.end_s)
    legend_above(rates)
    return figure
