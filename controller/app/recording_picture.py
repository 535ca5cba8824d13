"""A recording at a glance: midlines in place, and the angles of the body over time."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from config.errors import InputError
from controller.app.report.figures.style import ANGLES, FAINT, GREY, style
from controller.capture.track import Track

ENDINGS = (".png", ".svg", ".pdf")
_SHOWN = 24  # midlines over a recording: more run together
_COLUMNS = 900  # of the map: more cannot be seen


def draw(tracks: list[tuple[Track, str]], file: Path) -> None:
    """One row for each (recording, caption); written to ``file`` in the format of its ending.

    Raises:
        InputError: an ending that is no picture's.

    """
    if file.suffix.lower() not in ENDINGS:
        raise InputError(f"{file}: a picture ends in {', '.join(ENDINGS)}")
    with style():
        figure = Figure(figsize=(9.0, 2.9 * len(tracks)), layout="constrained", dpi=96)
        panels = figure.subplots(
            len(tracks), 2, squeeze=False, gridspec_kw={"width_ratios": [1.0, 1.7]}
        )
        for (track, caption), (left, right) in zip(tracks, panels, strict=True):
            _midlines(left, track)
            _map(figure, right, track)
            left.set_title(caption)
        file.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(file)


def _midlines(axes: Axes, track: Track) -> None:
    """Draw bodies where they were, light ones first; heads as dots."""
    some = np.unique(np.linspace(0, track.frames - 1, _SHOWN).astype(int))
    bodies = track.points[some]
    scale, unit = (1.0, "body lengths") if track.length_m is None else (1e3, "mm")
    bodies = (bodies - bodies.reshape(-1, 2).mean(axis=0)) * scale
    lines = LineCollection(list(bodies), linewidths=1.3, cmap="viridis_r", capstyle="round")
    lines.set_array(track.time_s[some])
    axes.add_collection(lines)
    heads = bodies[:, 0]
    axes.scatter(heads[:, 0], heads[:, 1], c=track.time_s[some], cmap="viridis_r", s=9, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_xlabel(unit)


def _map(figure: Figure, axes: Axes, track: Track) -> None:
    """Tangent angle about each frame's mean, head at the top; gaps stay grey."""
    frame = np.rint(track.time_s * track.rate_hz).astype(int)
    angles = np.full((frame[-1] + 1, track.angles_rad.shape[1]), np.nan)
    angles[frame] = track.angles_rad - track.angles_rad.mean(axis=1, keepdims=True)
    top = float(np.nanpercentile(np.abs(angles), 99.0))
    step = -(-len(angles) // _COLUMNS)
    axes.set_facecolor(FAINT)
    image = axes.imshow(
        angles[::step].T,
        aspect="auto",
        cmap=ANGLES,
        vmin=-top,
        vmax=top,
        extent=(0.0, float(track.time_s[-1]), 1.0, 0.0),
        interpolation="nearest",
    )
    axes.grid(visible=False)
    axes.set_xlabel("time, s" + (" (rate assumed)" if track.rate_assumed else ""))
    axes.set_yticks([0.0, 1.0], ["head", "tail"])
    axes.tick_params(axis="y", length=0, colors=GREY)
    bar = figure.colorbar(image, ax=axes, pad=0.02, fraction=0.05)
    bar.set_label("tangent angle, rad")
    bar.outline.set_visible(False)
