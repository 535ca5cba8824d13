"""One look for all figures: colours that colour-blind people can distinguish, thin grey frames."""

import base64
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats
from snakewalk.controller.console.result_files import atomic_write

INK: Final = "#22303c"
GREY: Final = "#8796a5"
PALE: Final = "#d9e0e6"
BLUE: Final = "#0072b2"
SKY: Final = "#56b4e9"
GREEN: Final = "#009e73"
AMBER: Final = "#e69f00"
RED: Final = "#d55e00"
PURPLE: Final = "#a4508b"
COLOURS: Final = {
    "ink": INK,
    "grey": GREY,
    "pale": PALE,
    "blue": BLUE,
    "sky": SKY,
    "green": GREEN,
    "amber": AMBER,
    "red": RED,
    "purple": PURPLE,
}
"""The palette by name, as ``column.Curve`` uses it."""
GROUND: Final = LinearSegmentedColormap.from_list(
    "ground", ["#7fa08c", "#b9c7a0", "#e6dcb8", "#cdb292", "#a68a78"]
)
ANGLES: Final = "RdBu_r"
WIDTH_IN: Final = 11.0
_POINTS: Final = 900  # across a figure: more cannot be seen
_RC: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e9edf1",
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "lines.linewidth": 1.5,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "svg.hashsalt": "snakewalk",
    "figure.facecolor": "white",
}


@contextmanager
def style() -> Iterator[None]:
    """Everything drawn inside looks alike."""
    with mpl.rc_context(_RC):
        yield


def canvas(
    rows: int, height_in: float, *, ratios: list[float] | None = None, share_x: bool = True
) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``rows`` panels one below the other."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    panels = figure.subplots(
        rows,
        1,
        sharex=share_x,
        squeeze=False,
        gridspec_kw={"height_ratios": ratios or [1.0] * rows},
    )
    return figure, list(panels[:, 0])


def trace(axes: Axes, time_s: Floats, values: Floats, colour: str, label: str) -> None:
    """Draw a curve; of one too long to be seen, the mean over a pale band from least to largest."""
    t, low, mean, high = thin(time_s, values)
    if not np.array_equal(low, high, equal_nan=True):
        axes.fill_between(t, low, high, color=colour, alpha=0.25, linewidth=0)
    axes.plot(t, mean, color=colour, linewidth=1.3, label=label)


def thin(time_s: Floats, values: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Time, least, mean and largest of every few samples; short series (n,) as they are."""
    known = np.isfinite(values)
    time_s, values = time_s[known], values[known]
    size = -(-len(time_s) // _POINTS)
    if size < 3:
        return time_s, values, values, values
    first = np.arange(0, len(time_s), size)
    count = np.diff(np.append(first, len(time_s)))
    return (
        np.add.reduceat(time_s, first) / count,
        np.minimum.reduceat(values, first),
        np.add.reduceat(values, first) / count,
        np.maximum.reduceat(values, first),
    )


def legend_above(axes: Axes, columns: int = 6) -> None:
    """Legend in one row over the right end of the panel: it never covers a curve."""
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.1,
        handlelength=1.6, columnspacing=1.4,
    )  # fmt: skip


def name_joints(axes: Axes, names: Sequence[str]) -> None:
    """Label the vertical axis with the names of some joints; the first joint is at 0."""
    places = range(0, len(names), max(1, -(-len(names) // 5)))
    axes.set_yticks(places, [names[k] for k in places])


def mark_waypoints(panels: list[Axes], times_s: Floats, *, measured: bool) -> None:
    """Draw vertical lines where waypoints were reached, numbered on the first panel.

    The lines are dashed if the arrivals are not measured.
    """
    for number, time in enumerate(times_s, start=1):
        for axes in panels:
            axes.axvline(
                time,
                color=GREEN,
                linewidth=0.9,
                alpha=0.7,
                zorder=0.5,
                linestyle="-" if measured else (0, (3, 3)),
            )
        panels[0].annotate(
            str(number), (time, 1.0), (3, -3), xycoords=("data", "axes fraction"),
            textcoords="offset points", va="top", color=GREEN, fontsize=9, fontweight="bold",
        )  # fmt: skip


def save_picture(figure: Figure, path: Path, dpi: float | None = None) -> None:
    """Write a figure in the format of the path's ending, whole or not at all."""
    with atomic_write(path) as part:
        figure.savefig(part, dpi=dpi or figure.dpi)


def data_uri(figure: Figure) -> str:
    """Figure as an SVG image for an HTML page; the same figure gives the same bytes."""
    buffer = BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()
