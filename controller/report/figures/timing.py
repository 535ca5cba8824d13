"""The loop's time: how full the wire was, how late cycles began, which deadlines were missed."""

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, BLUE, GREY, RED
from snakewalk.controller.figures.style import canvas, legend_above, trace
from snakewalk.controller.metrics.timing import skipped_cycles
from snakewalk.controller.runlog.record import RunRecord


def timing_figure(record: RunRecord) -> Figure | None:
    """Time inside the cycle, over the run; None without a cycle."""
    cycle = record.cycle
    if len(cycle.time_s) < 2:
        return None
    figure, (axes,) = canvas(1, 3.2)
    period_ms = 1e3 * record.period_s
    if np.isfinite(cycle.wire_busy_s).any():
        trace(axes, cycle.deadline_s, 1e3 * cycle.wire_busy_s, BLUE, "bytes on the wire")
    trace(axes, cycle.deadline_s, 1e3 * cycle.lateness_s, AMBER, "cycle began late by")
    axes.axhline(period_ms, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), label="period")
    missed = np.flatnonzero(skipped_cycles(record))
    if len(missed):
        axes.scatter(
            cycle.deadline_s[missed + 1],
            np.full(len(missed), period_ms),
            marker="v",
            s=42,
            color=RED,
            label="deadlines missed",
            zorder=3,
        )
    top = float(np.nanmax(np.append(1e3 * cycle.lateness_s, period_ms)))
    axes.set_ylim(0.0, 1.12 * top)
    axes.set_ylabel("time (ms)")
    axes.set_xlabel("time (s)")
    axes.set_xlim(0.0, max(record.end_s, 1e-3))
    legend_above(axes)
    return figure
