"""A quantity along the body over time as a map: time to the right, head at the top."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.controller.figures.style import ANGLES, GREY, PALE
from snakewalk.controller.track.track import Track

_COLUMNS = 330  # more cannot be seen


def body_map(
    figure: Figure,
    axes: Axes,
    track: Track,
    values: Floats,
    label: str,
    kept: NDArray[np.int64] | None = None,
    limit: float | None = None,
) -> None:
    """Draw values (S, N), one row a frame, with zero white; unknown values stay grey.

    Args:
        figure: for the colour bar.
        axes: where to draw.
        track: whose times and frame rate count.
        values: NaN where unknown.
        label: of the colour bar.
        kept: (S,) indices of the track's frames that the rows belong to; default all.
        limit: of the colours; default what 99 % of the values stay within.

    """
    rows = np.arange(track.frames) if kept is None else kept
    frame = np.rint(track.time_s * track.rate_hz).astype(int)
    full = np.full((frame[-1] + 1, values.shape[1]), np.nan)
    full[frame[rows]] = values
    top = float(np.nanpercentile(np.abs(values), 99.0)) if limit is None else limit
    axes.set_facecolor(PALE)
    image = axes.imshow(
        _thin(full).T,
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
    bar.set_label(label)
    bar.outline.set_visible(False)


def _thin(rows: Floats) -> Floats:
    """Means of as many neighbouring rows as share a column of the picture."""
    size = -(-len(rows) // _COLUMNS)
    if size == 1:
        return rows
    short = np.full((-len(rows) % size, rows.shape[1]), np.nan)
    blocks = np.concatenate([rows, short]).reshape(-1, size, rows.shape[1])
    known = np.isfinite(blocks)
    count = known.sum(axis=1)
    total = np.where(known, blocks, 0.0).sum(axis=1)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))
