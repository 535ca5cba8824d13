"""One look for all figures: colours that colour-blind people can distinguish, thin grey frames."""

import base64
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import GREEN, GREY, INK
from snakewalk.controller.console.result_files import atomic_write

GROUND = LinearSegmentedColormap.from_list("ground", ["#93a07c", "#c3bd98", "#f2ead6"])
"""Heights, lighter the higher: the tones of the film, paler, so that lines on them are seen."""
ANGLES = "RdBu_r"
"""Values about zero, which is white."""
TIMES = "viridis_r"
"""Times, later ones darker."""
SPEEDS = "viridis"
"""Values of one sign."""
WIDTH_IN = 8.0
"""Width of a figure: at 600 px, text of 8.5 points is 9 px high."""
_POINTS = 900  # across a figure: more cannot be seen
_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.titlesize": 10.0,
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
    """Draw with the common style inside this context."""
    with mpl.rc_context(_RC):
        yield


def canvas(rows: int, height_in: float) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``rows`` panels one below the other."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    return figure, list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])


def label_time(axes: Axes, end_s: float) -> None:
    """Label the axis of the time of a run, from torque on to its end."""
    axes.set_xlabel("time (s)")
    axes.set_xlim(0.0, max(end_s, 1e-3))


def trace(axes: Axes, time_s: Floats, values: Floats, colour: str, label: str) -> None:
    """Draw a curve; of one too long to be seen, the mean over a pale band from least to largest."""
    t, low, mean, high = thin(time_s, values)
    if not np.array_equal(low, high, equal_nan=True):
        axes.fill_between(t, low, high, color=colour, alpha=0.25, linewidth=0)
    axes.plot(t, mean, color=colour, linewidth=1.3, label=label)


def thin(
    time_s: Floats, values: Floats, points: int = _POINTS
) -> tuple[Floats, Floats, Floats, Floats]:
    """Time, least, mean and largest of every few samples; short series (n,) as they are."""
    is_known = np.isfinite(values)
    time_s = time_s[is_known]
    values = values[is_known]
    size = -(-len(time_s) // points)
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
    """Place the legend over the right end of the panel, where it never covers a curve."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=columns,
        borderaxespad=0.1,
        handlelength=1.6,
        columnspacing=1.4,
    )


def colour_bar(figure: Figure, image: ScalarMappable, axes: Axes, label: str) -> None:
    """Draw the scale of an image; arrows at its ends mark values beyond it."""
    values: Floats = np.ma.filled(np.ma.asarray(image.get_array(), float), np.nan)
    low, high = (float(edge) for edge in image.get_clim())
    slack = 1e-9 * (high - low)
    below, above = bool((values < low - slack).any()), bool((values > high + slack).any())
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max"}
    bar = figure.colorbar(
        image, ax=axes, pad=0.02, aspect=14, extend=extend.get((below, above), "both")
    )
    bar.set_label(label)
    bar.outline.set_visible(False)
    bar.ax.yaxis.set_major_locator(MaxNLocator(5))


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
            str(number),
            (time, 1.0),
            (3, -3),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            va="top",
            color=GREEN,
            fontsize=9,
            fontweight="bold",
        )


def save_picture(figure: Figure, path: Path, dpi: float | None = None) -> None:
    """Write a figure in the format of the path's ending, whole or not at all."""
    if path.suffix.lower() == ".png":
        _lay_out(FigureCanvasAgg(figure), dpi or figure.dpi)
    with atomic_write(path) as part:
        figure.savefig(part, dpi=dpi or figure.dpi)


def data_uri(figure: Figure) -> str:
    """Figure as an SVG image for an HTML page; the same figure gives the same bytes."""
    buffer = BytesIO()
    _lay_out(FigureCanvasSVG(figure), FigureCanvasSVG.fixed_dpi)
    times = {axes.get_xlim() for axes in figure.axes if axes.get_xlabel().startswith("time")}
    for axes in figure.axes:
        if axes.get_xlim() in times:  # the page moves a cursor over them
            axes.set_gid("time {} {}".format(*axes.get_xlim()))
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()


def _lay_out(canvas: FigureCanvasBase, dpi: float) -> None:
    """Place the panels of a figure once and for all, for a canvas and its resolution.

    ``savefig`` would draw the whole figure twice, the first time only to place its panels; with an
    engine that is switched off by ``"none"`` it does so, too.
    """
    figure = canvas.figure
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(dpi)
        engine.execute(figure)
        figure.set_layout_engine(None)
