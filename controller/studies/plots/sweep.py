"""A sweep as a picture: for each gait, cost of transport over pace."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from snakewalk.config.colours import GREY, SERIES
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_table import UNITS, number, pace

_PANELS_ACROSS = 3


def draw_sweep(rows: list[dict[str, str]], path: Path) -> None:
    """Draw small multiples, a panel a gait, a colour a robot, a ring around the defaults."""
    gaits = list(dict.fromkeys(row["gait"] for row in rows))
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    colours = {robot: SERIES[k % len(SERIES)] for k, robot in enumerate(robots)}
    across = min(_PANELS_ACROSS, len(gaits))
    down = -(-len(gaits) // across)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 0.7 + 2.3 * down), layout="constrained")
        axes = figure.subplots(down, across, squeeze=False, sharey=True)
        for panel in axes.flat[len(gaits) :]:
            panel.set_axis_off()
        of_unit: dict[str, Axes] = {}
        for panel, gait in zip(axes.flat, gaits, strict=False):
            same_unit = of_unit.setdefault(UNITS[GAITS[gait].aim], panel)
            if same_unit is not panel:
                panel.sharex(same_unit)
            _panel(panel, gait, [row for row in rows if row["gait"] == gait], colours)
        handles = [
            Line2D([], [], color=colours[robot], label=robot, marker="o", linestyle="")
            for robot in robots
        ]
        ring = Line2D(
            [],
            [],
            color=GREY,
            markersize=9,
            markerfacecolor="none",
            marker="o",
            linestyle="",
            label="default parameters",
        )
        figure.legend(handles=[*handles, ring], loc="outside upper center", ncols=4)
        save_picture(figure, path, dpi=110)


def _panel(axes: Axes, gait: str, rows: list[dict[str, str]], colours: dict[str, str]) -> None:
    drawn = 0
    for robot, colour in colours.items():
        some = [
            row
            for row in rows
            if row["robot"] == robot
            and np.isfinite(pace(row))
            and 0.0 < number(row, "cost_of_transport") < np.inf
        ]
        drawn += len(some)
        paces = [pace(row) for row in some]
        cost = [number(r, "cost_of_transport") for r in some]
        axes.scatter(paces, cost, s=11, color=colour, alpha=0.75, linewidths=0)
        for r, x, y in zip(some, paces, cost, strict=True):
            if r["number"] == "0":
                axes.scatter([x], [y], s=70, facecolors="none", edgecolors=colour)
    left_out = len(rows) - drawn
    axes.set_title(f"{gait}\n" + f"{left_out} of {len(rows)} without pace or cost" * bool(left_out))
    axes.set_ylabel("cost of transport")
    axes.set_xlabel(f"pace ({UNITS[GAITS[gait].aim]})")
    axes.xaxis.set_major_locator(MaxNLocator(4))
    if drawn:  # else none moved far enough to have a cost
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=7))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
