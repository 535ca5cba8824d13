"""An animal's motion as pictures: tracks of its points, angle map, pulse speed map, swings.

The tracks are those of [PT] Fig. 4 (one path for all points: no sliding), the maps those of Fig. 5.
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from snakewalk.config.colours import AMBER, BLUE, GREEN, GREY, HEAD, INK, PALE
from snakewalk.controller.capture.plots.recording import midlines
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.body_map import body_map
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.track.analysis import Analysis
from snakewalk.controller.track.undulation import even_points

_BODIES = 60  # drawn under the paths
_BINS = 20


def draw_analysis(analysis: Analysis, file: Path) -> None:
    """Write one picture in the format of its ending.

    Raises:
        InputError: the ending does not belong to a picture.

    """
    check_picture(file)
    track = analysis.track
    pulse = analysis.pulse
    unknown = analysis.pulse_unknown_reason
    scale = track.rate_hz / track.angles_rad.shape[1]
    with style():
        figure = Figure(figsize=(WIDTH_IN, 8.4), layout="constrained", dpi=110)
        (tracks, angles), (swings, speeds), (against, errors) = figure.subplots(
            3, 2, gridspec_kw={"width_ratios": [1.0, 1.5]}
        )
        _tracks(tracks, analysis)
        swing = track.angles_rad - track.angles_rad.mean(axis=1, keepdims=True)
        body_map(figure, angles, track, swing, "angle (rad)")
        angles.set_title("angle about the mean heading")
        _swings(swings, analysis)
        if unknown is None:
            _speeds(figure, speeds, analysis, scale)
            body_map(figure, errors, track, pulse.body_error_rad, "error (rad)", kept=pulse.frame)
            errors.set_title("error of one speed for the whole body")
            _error_by_slope(against, analysis)
        else:
            for axes in (speeds, errors, against):
                axes.set_axis_off()
            speeds.text(0.0, 0.5, f"pulse speed unknown:\n{unknown}", fontsize=9, wrap=True)
        save_picture(figure, file)


def _speeds(figure: Figure, axes: Axes, analysis: Analysis, scale: float) -> None:
    """Draw the pulse speed by body and time, body lengths a second."""
    pulse = analysis.pulse
    speed = pulse.points_per_frame * scale
    low, high = np.nanpercentile(speed, [2.5, 97.5]).tolist()
    if low < 0.0 < high:
        high = max(-low, high)
        low = -high
    body_map(
        figure,
        axes,
        analysis.track,
        speed,
        "body lengths per s",
        kept=pulse.frame,
        limits=(low, max(high, low + 1e-9)),
    )
    axes.set_title("pulse speed to the tail; grey: unknown")


def _tracks(axes: Axes, analysis: Analysis) -> None:
    """Draw the paths of head, middle and tail, over the bodies."""
    body = even_points(analysis.track)
    if body is None:
        midlines(axes, analysis.track)
        axes.set_title("shapes (no places)")
        return
    some = np.unique(np.linspace(0, len(body) - 1, _BODIES).astype(int))
    axes.add_collection(LineCollection(list(body[some]), linewidths=1.0, colors=PALE, zorder=1))
    middle = body.shape[1] // 2
    for point, colour, name in ((-1, AMBER, "tail"), (middle, GREEN, "middle"), (0, HEAD, "head")):
        x, y = body[:, point].T
        axes.plot(x, y, color=colour, linewidth=1.1, label=name)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.legend(loc="best", fontsize=8.5, handlelength=1.0)
    axes.set_xlabel("x (body lengths)")
    axes.set_ylabel("y (body lengths)")
    axes.set_title("tracks")


def _error_by_slope(axes: Axes, analysis: Analysis) -> None:
    """Draw the absolute error against the slope along the body, in bins of equal counts."""
    error = np.abs(analysis.pulse.body_error_rad)
    slope = analysis.slope_rad
    is_finite = np.isfinite(error)
    order = np.argsort(slope[is_finite])
    parts = [np.array_split(values[is_finite][order], _BINS) for values in (slope, error)]
    x, (low, middle, high) = (
        np.array([part.mean() for part in parts[0]]),
        np.array([np.percentile(part, [25.0, 50.0, 75.0]) for part in parts[1]]).T,
    )
    axes.fill_between(x, low, high, color=PALE)
    axes.plot(x, middle, color=BLUE, label="median, 25 to 75 %")
    fit = analysis.error_slope
    if fit is not None:
        axes.plot(x, fit[0] * x, color=INK, linestyle="--", label=f"fit: {fit[0]:.2f} points")
    axes.set_xlim(0.0, float(x[-1]))
    axes.set_ylim(0.0, None)
    axes.set_xlabel("slope along the body (rad per point)")
    axes.set_ylabel("error (rad)")
    axes.legend(loc="upper left", fontsize=8.5)
    axes.set_title("error by the slope")


def _swings(axes: Axes, analysis: Analysis) -> None:
    """Draw both amplitudes along the body."""
    how = analysis.undulation
    along = np.linspace(0.0, 1.0, len(how.lateral))
    axes.plot(along, how.lateral, color=BLUE)
    axes.set_ylim(0.0, 1.15 * float(how.lateral.max()))
    axes.set_ylabel("sideways (body lengths)", color=BLUE)
    axes.set_xticks([0.0, 0.5, 1.0], ["head", "middle", "tail"])
    other = axes.twinx()
    other.grid(visible=False)
    other.spines["right"].set_visible(True)
    other.spines["right"].set_color(GREY)
    other.plot(0.5 * (along[1:] + along[:-1]), how.angle_rad, color=INK, linestyle="--")
    other.set_ylim(0.0, 1.15 * float(how.angle_rad.max()))
    other.set_ylabel("angle (rad, dashed)", color=INK)
    axes.set_title("amplitude")
