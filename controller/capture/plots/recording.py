"""A recording at a glance: midlines in place, and the angles of the body over time."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.body_map import body_map
from snakewalk.controller.figures.style import TIMES, WIDTH_IN, save_picture, style
from snakewalk.controller.track.track import Track

_SHOWN_FRAMES = 24  # midlines over a recording: more run together


def draw(tracks: list[tuple[Track, str]], file: Path) -> None:
    """Draw one row for each (recording, caption) to ``file``, in the format of its ending.

    Raises:
        InputError: the ending does not belong to a picture.

    """
    check_picture(file)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 2.9 * len(tracks)), layout="constrained", dpi=110)
        panels = figure.subplots(
            len(tracks), 2, squeeze=False, gridspec_kw={"width_ratios": [1.0, 1.7]}
        )
        for (track, caption), (left, right) in zip(tracks, panels, strict=True):
            figure.colorbar(midlines(left, track), ax=left, pad=0.02, label="time (s)")
            swing = track.angles_rad - track.angles_rad.mean(axis=1, keepdims=True)
            body_map(figure, right, track, swing, "tangent angle (rad)")
            right.set_title("angle about the mean heading")
            left.set_title(caption)
        save_picture(figure, file)


def midlines(axes: Axes, track: Track) -> LineCollection:
    """Draw bodies in place, light ones first, with heads as dots; return the lines."""
    some = np.unique(np.linspace(0, track.frames - 1, _SHOWN_FRAMES).astype(int))
    bodies = track.points[some]
    scale, unit = (1.0, "body lengths") if track.length_m is None else (1e3, "mm")
    bodies = (bodies - bodies.reshape(-1, 2).mean(axis=0)) * scale
    lines = LineCollection(list(bodies), linewidths=1.3, cmap=TIMES, capstyle="round")
    lines.set_array(track.time_s[some])
    axes.add_collection(lines)
    heads = bodies[:, 0]
    axes.scatter(heads[:, 0], heads[:, 1], c=track.time_s[some], cmap=TIMES, s=9, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_xlabel(f"x ({unit})")
    axes.set_ylabel(f"y ({unit})")
    return lines
