"""Runs over each other: tracks from above, then path error, speed, current and tracking error."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from snakewalk.config.colours import GREY, SERIES
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style, thin
from snakewalk.controller.studies.run_comparison import ComparedRun

_OF_THE_POSE = ("path_error_m", "speed_m_s")
"""Panels that are dashed where the pose was dead-reckoned."""


def draw_comparison(runs: Sequence[ComparedRun], path: Path) -> None:
    """Draw one colour a run; panels that no run has values for are left out."""
    panels = [
        (
            title,
            unit,
            key,
            [getattr(run, key) for run in runs],
            [getattr(run, time_key) for run in runs],
        )
        for title, unit, key, time_key in (
            ("Centre of mass from the path", "m", "path_error_m", "pose_s"),
            ("Speed of the centre of mass, mean of 2 s", "m/s", "speed_m_s", "pose_s"),
            ("Highest current of a joint", "A", "current_a", "cycle_s"),
            ("Measured minus sent, RMS of the joints", "rad", "tracking_rms_rad", "cycle_s"),
        )
    ]
    panels = [panel for panel in panels if any(np.isfinite(v).any() for v in panel[3])]
    with style():
        figure = Figure(figsize=(WIDTH_IN, 4.6 + 1.9 * len(panels)), layout="constrained")
        tracks, *rest = figure.subplots(
            1 + len(panels),
            1,
            squeeze=False,
            gridspec_kw={"height_ratios": [2.4, *([1.0] * len(panels))]},
        )[:, 0]
        _draw_tracks(tracks, runs)
        for axes, (title, unit, key, values, times) in zip(rest, panels, strict=True):
            for number, (time_s, value) in enumerate(zip(times, values, strict=True)):
                if np.isfinite(value).any():
                    thin_time_s, _, mean, _ = thin(time_s, value)
                    colour = SERIES[number % len(SERIES)]
                    is_solid = key not in _OF_THE_POSE or runs[number].summary.is_measured
                    dash = "-" if is_solid else "--"
                    axes.plot(thin_time_s, mean, color=colour, linewidth=1.1, linestyle=dash)
            axes.set_title(title)
            axes.set_ylabel(unit)
            axes.set_xlim(left=0.0)
            if axes is not rest[0]:
                axes.sharex(rest[0])
        if rest:
            rest[-1].set_xlabel("time (s)")
        save_picture(figure, path, dpi=110)


def _draw_tracks(axes: Axes, runs: Sequence[ComparedRun]) -> None:
    for number, run in enumerate(runs):
        axes.plot(
            *run.centre_m.T,
            color=SERIES[number % len(SERIES)],
            label=f"{run.name} ({run.pose})",
            linewidth=1.3,
            linestyle="-" if run.summary.is_measured else "--",
        )
    first = runs[0]
    alike = all(np.array_equal(run.waypoints_m, first.waypoints_m) for run in runs)
    for number, (x, y) in enumerate(first.waypoints_m if alike else (), start=1):
        axes.add_patch(
            Circle((float(x), float(y)), first.waypoint_radius_m, color=GREY, alpha=0.15)
        )
        axes.annotate(str(number), (x, y), ha="center", va="center", color=GREY)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("Centre of mass from above")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.figure.legend(loc="outside upper left")
