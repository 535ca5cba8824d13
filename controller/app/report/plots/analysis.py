"""An animal's motion as pictures: tracks of its points, angle map, pulse speed map, swings.

The tracks are those of [PT] Fig. 4 (one path for all points: no sliding), the maps those of Fig. 5.
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from snakewalk.controller.app.report.figures.style import (
    AMBER,
    BLUE,
    GREEN,
    GREY,
    INK,
    PALE,
    save_picture,
    style,
)
from snakewalk.controller.app.report.plots.body_map import body_map
from snakewalk.controller.app.report.plots.recording import midlines
from snakewalk.controller.app.result_files import check_picture
from snakewalk.controller.capture.analysis import Analysis
from snakewalk.controller.capture.undulation import even_points

_BODIES = 60  # drawn under the paths


def draw_analysis(found: Analysis, file: Path) -> None:
    """Write one picture in the format of its ending.

    Raises:
        InputError: an ending that is no picture's.

    """
    check_picture(file)
    track, pulse = found.track, found.pulse
    scale = track.rate_hz / track.angles_rad.shape[1]
    usual = abs(pulse.typical) * scale
    with style():
        figure = Figure(figsize=(10.5, 5.4), layout="constrained", dpi=76)
        (tracks, angles), (swings, speeds) = figure.subplots(
            2, 2, gridspec_kw={"width_ratios": [1.0, 1.7]}
        )
        _tracks(tracks, found)
        swing = track.angles_rad - track.angles_rad.mean(axis=1, keepdims=True)
        body_map(figure, angles, track, swing, "rad")
        angles.set_title("tangent angle about the mean heading")
        _swings(swings, found)
        known = np.isfinite(pulse.points_per_frame)
        most = float(np.percentile(np.abs(pulse.points_per_frame[known]), 95.0)) * scale
        body_map(
            figure,
            speeds,
            track,
            pulse.points_per_frame * scale,
            "body lengths a second",
            kept=pulse.frame,
            limit=max(1e-9, min(max(most, usual), 3.0 * usual)),
        )
        speeds.set_title("pulse speed, positive towards the tail; grey: not known")
        file.parent.mkdir(parents=True, exist_ok=True)
        save_picture(figure, file)


def _tracks(axes: Axes, found: Analysis) -> None:
    """Draw where head, middle and tail went, over the bodies."""
    body = even_points(found.track)
    if body is None:
        midlines(axes, found.track)
        axes.set_title("shapes (places not recorded)")
        return
    some = np.unique(np.linspace(0, len(body) - 1, _BODIES).astype(int))
    axes.add_collection(LineCollection(list(body[some]), linewidths=1.0, colors=PALE, zorder=1))
    middle = body.shape[1] // 2
    for point, colour, name in ((-1, AMBER, "tail"), (middle, GREEN, "middle"), (0, BLUE, "head")):
        x, y = body[:, point].T
        axes.plot(x, y, color=colour, linewidth=1.1, label=name)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.legend(loc="best", fontsize=8, handlelength=1.2)
    axes.set_xlabel("body lengths")
    axes.set_title("tracks of head, middle and tail")


def _swings(axes: Axes, found: Analysis) -> None:
    """Draw both amplitudes along the body."""
    how = found.undulation
    along = np.linspace(0.0, 1.0, len(how.lateral))
    axes.plot(along, how.lateral, color=BLUE)
    axes.set_ylim(0.0, 1.15 * float(how.lateral.max()))
    axes.set_ylabel("sideways, body lengths", color=BLUE)
    axes.set_xticks([0.0, 0.5, 1.0], ["head", "middle", "tail"])
    other = axes.twinx()
    other.grid(visible=False)
    other.spines["right"].set_visible(True)
    other.spines["right"].set_color(GREY)
    other.plot(0.5 * (along[1:] + along[:-1]), how.angle_rad, color=INK, linestyle="--")
    other.set_ylim(0.0, 1.15 * float(how.angle_rad.max()))
    other.set_ylabel("angle, rad (dashed)", color=INK)
    axes.set_title("amplitude along the body")
