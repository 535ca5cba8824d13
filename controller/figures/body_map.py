"""A quantity along the body over time as a map: time to the right, head at the top."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.colours import GREY, PALE
from snakewalk.controller.figures.style import ANGLES, SPEEDS, colour_bar
from snakewalk.controller.track.track import Track

_COLUMNS = 330  # more cannot be seen


def body_map(
    figure: Figure,
    axes: Axes,
    track: Track,
    values: Floats,
    label: str,
    kept: Ints | None = None,
    limits: tuple[float, float] | None = None,
) -> None:
    """Draw values (S, N), one row a frame; unknown values stay grey.

    Args:
        figure: for the colour bar.
        axes: where to draw.
        track: whose times and frame rate count.
        values: NaN where unknown.
        label: of the colour bar.
        kept: (S,) indices of the track's frames that the rows belong to; default all.
        limits: of the colours; default what 99 % of the values stay within, with zero white.

    """
    rows = np.arange(track.frames) if kept is None else kept
    frame = np.rint(track.time_s * track.rate_hz).astype(int)
    full = np.full((frame[-1] + 1, values.shape[1]), np.nan)
    full[frame[rows]] = values
    if limits is None:
        top = float(np.nanpercentile(np.abs(values), 99.0))
        limits = (-top, top)
    low, high = limits
    axes.set_facecolor(PALE)
    image = axes.imshow(
        _thinned_rows(full).T,
        aspect="auto",
        cmap=ANGLES if low < 0.0 < high else SPEEDS,
        vmin=low,
        vmax=high,
        extent=(0.0, float(track.time_s[-1]), 1.0, 0.0),
        interpolation="nearest",
    )
    axes.grid(visible=False)
    axes.set_xlabel("time (s" + (", rate assumed)" if track.rate_assumed else ")"))
    axes.set_yticks([0.0, 1.0], ["head", "tail"])
    axes.tick_params(axis="y", length=0, colors=GREY)
    finite_values = values[np.isfinite(values)]
    beyond = float(np.mean((finite_values < low) | (finite_values > high)))
    colour_bar(figure, image, axes, label if beyond < 0.02 else f"{label} ({beyond:.0%} beyond)")


def _thinned_rows(rows: Floats) -> Floats:
    """Means of as many neighbouring rows as share a column of the picture."""
    size = -(-len(rows) // _COLUMNS)
    if size == 1:
        return rows
    short = np.full((-len(rows) % size, rows.shape[1]), np.nan)
    blocks = np.concatenate([rows, short]).reshape(-1, size, rows.shape[1])
    is_known = np.isfinite(blocks)
    count = is_known.sum(axis=1)
    total = np.where(is_known, blocks, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
