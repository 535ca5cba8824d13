"""Joint angles over time as three maps: goals, measured angles, and their difference."""

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import PALE
from snakewalk.controller.figures.style import ANGLES, canvas, colour_bar, name_joints
from snakewalk.controller.runlog.record import RunRecord

_COLUMNS = 1400
_PARTS = 32
"""Parts of a long log that are in memory one after the other (ours)."""


def joints_figure(record: RunRecord) -> Figure | None:
    """Joint against time, head at the top; None without a cycle."""
    cycle = record.cycle
    if len(cycle.time_s) < 2:
        return None
    joints = cycle.asked_rad.shape[1]
    grid = np.linspace(cycle.time_s[0], cycle.time_s[-1], min(_COLUMNS, len(cycle.time_s)))
    rows = np.searchsorted(cycle.time_s, grid).clip(0, len(cycle.time_s) - 1)
    asked, measured, valid = (
        np.concatenate([getattr(cycle, name)[some] for some in np.array_split(rows, _PARTS)])
        for name in ("asked_rad", "measured_rad", "valid")
    )
    gap = np.where(valid, measured - asked, np.nan)
    span = _largest_value(np.concatenate([asked, measured]))
    height = float(np.clip(0.075 * joints, 1.2, 2.6)) * 3 + 0.9
    figure, panels = canvas(3, height)
    extent = (float(grid[0]), float(grid[-1]), joints - 0.5, -0.5)
    for axes, values, title, limit in zip(
        panels,
        (asked, measured, gap),
        ("Asked", "Measured", "Measured minus asked"),
        (span, span, _largest_value(gap)),
        strict=True,
    ):
        image = axes.imshow(
            values.T,
            aspect="auto",
            cmap=ANGLES,
            vmin=-limit,
            vmax=limit,
            extent=extent,
            interpolation="nearest",
        )
        axes.set_title(title)
        axes.grid(visible=False)
        axes.set_facecolor(PALE)
        name_joints(axes, record.header.robot.joint_names)
        axes.set_ylabel("joint")
        colour_bar(figure, image, axes, "rad")
    panels[-1].set_xlabel("time (s); the head is at the top; grey: no reply in that cycle")
    return figure


def _largest_value(values: Floats) -> float:
    finite_values = np.abs(values[np.isfinite(values)])
    return max(np.quantile(finite_values, 0.999), 1e-3) if finite_values.size else 1e-3
