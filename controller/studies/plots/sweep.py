"""A sweep as a picture: for each gait, how far a cycle carries against what it costs."""

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from snakewalk.controller.figures.style import save_picture
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_table import UNITS, number, pace

matplotlib.use("Agg")

_COLOURS = ("#1f6fb2", "#c8553d", "#4f8a4f", "#7a5195")


def draw_sweep(rows: list[dict[str, str]], path: Path) -> None:
    """Draw small multiples, a panel a gait, a colour a robot, a ring around the defaults."""
    gaits = list(dict.fromkeys(row["gait"] for row in rows))
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    across = min(4, len(gaits))
    down = -(-len(gaits) // across)
    figure, axes = plt.subplots(
        down, across, figsize=(3.2 * across, 2.6 * down), squeeze=False, layout="constrained"
    )
    for panel in axes.flat[len(gaits) :]:
        panel.axis("off")
    for panel, gait in zip(axes.flat, gaits, strict=False):
        measured = False
        for colour, robot in zip(_COLOURS, robots, strict=False):
            some = [r for r in rows if (r["gait"], r["robot"]) == (gait, robot) and r["cycles"]]
            paces = [pace(row) for row in some]
            cost = [number(r, "cost_of_transport") for r in some]
            measured = measured or any(value > 0.0 for value in cost)
            panel.scatter(paces, cost, s=9, color=colour, alpha=0.75, linewidths=0, label=robot)
            for r, x, y in zip(some, paces, cost, strict=True):
                if r["number"] == "0":
                    panel.scatter([x], [y], s=60, facecolors="none", edgecolors=colour)
        panel.set_title(gait, fontsize=10)
        panel.set_xlabel(UNITS[GAITS[gait].aim], fontsize=8)
        panel.xaxis.set_major_locator(MaxNLocator(4))
        panel.set_yscale("log" if measured else "linear")  # none moved far enough to have a cost
        panel.tick_params(labelsize=7)
        panel.spines[["top", "right"]].set_visible(False)
    figure.supylabel("cost of transport (log); rings: defaults", fontsize=9)
    handles = [
        Line2D([], [], marker="o", ls="", color=colour, label=robot)
        for colour, robot in zip(_COLOURS, robots, strict=False)
    ]
    figure.legend(handles=handles, loc="outside upper right", fontsize=8, ncols=4, frameon=False)
    save_picture(figure, path, dpi=110)
    plt.close(figure)
