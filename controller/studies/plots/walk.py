"""Fig. 9 of [PT]: states seen over steps, a panel for each kind of graph (needs matplotlib)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, BLUE, GREEN, INK, PURPLE, RED
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.studies.graph_study import StudyResult

_COLORS = {
    "snake": BLUE,
    "snake-printed": AMBER,
    "frontier": INK,
    "stack": RED,
    "random": GREEN,
    "degree": PURPLE,
}
_MOST_SHOWN_COVER = 4.5  # steps over |V|; later dots are left out
_LEAST_PERCENT = 40.0  # % of the states: below, all curves are one


def draw(results: Sequence[StudyResult], file: Path) -> None:
    """Write the picture in the format of its ending.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    graphs = list(dict.fromkeys(result.graph for result in results))
    columns = min(3, len(graphs))
    rows = -(-len(graphs) // columns)
    with style():
        size = (WIDTH_IN * max(columns, 1.7) / 3.0, 1.0 + 2.4 * rows)
        figure = Figure(figsize=size, layout="constrained", dpi=110)
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        for axes, graph in zip(panels.flat, graphs, strict=False):
            for result in (graph_result for graph_result in results if graph_result.graph == graph):
                color = _COLORS[result.rule]
                axes.plot(result.grid, 100.0 * result.visited, color=color, label=result.rule)
                if (
                    np.isfinite(result.cover).any()
                    and np.nanmean(result.cover) <= _MOST_SHOWN_COVER
                ):
                    end = float(np.nanmean(result.cover))
                    axes.plot(end, 100.0, "o", color=color, ms=5, clip_on=False)
            axes.set(xlim=(0.0, _MOST_SHOWN_COVER), ylim=(_LEAST_PERCENT, 100.0), title=graph)
        for axes in panels.flat[len(graphs) :]:
            axes.set_axis_off()
        for axes in panels[:, 0]:
            axes.set_ylabel("states seen (%)")
        for axes in panels[-1]:
            axes.set_xlabel("steps / |V| (dot: all seen)")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
        save_picture(figure, file)
