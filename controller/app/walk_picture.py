"""Fig. 9 of [PT]: states seen over steps, a panel for each kind of graph (needs matplotlib)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from config.errors import InputError
from controller.shape.study import StudyResult

ENDINGS = (".png", ".svg", ".pdf")
_SHOWN = 4.5
"""Steps over |V|: what comes later is cut off, dots too."""


def check_file(file: Path) -> None:
    """Raise InputError where ``file`` does not end as a picture does."""
    if file.suffix.lower() not in ENDINGS:
        raise InputError(f"{file}: a picture ends in {', '.join(ENDINGS)}")


def draw(results: Sequence[StudyResult], file: Path) -> None:
    """Write the picture in the format of the ending of ``file``.

    Raises:
        InputError: an ending that is no picture's.

    """
    check_file(file)
    graphs = list(dict.fromkeys(result.graph for result in results))
    rules = list(dict.fromkeys(result.rule for result in results))
    columns = min(3, len(graphs))
    rows = -(-len(graphs) // columns)
    figure = Figure(figsize=(1.2 + 3.0 * columns, 0.8 + 2.4 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes in panels[len(graphs) :]:
        axes.set_axis_off()
    for axes, graph in zip(panels, graphs, strict=False):
        for result in (one for one in results if one.graph == graph):
            color = f"C{rules.index(result.rule)}"
            axes.plot(result.grid, 100.0 * result.visited, color=color)
            if np.isfinite(result.cover).any() and np.nanmean(result.cover) <= _SHOWN:
                axes.plot(np.nanmean(result.cover), 100.0, "o", color=color, clip_on=False)
        axes.set(xlim=(0.0, _SHOWN), ylim=(0.0, 100.0), title=graph)
        axes.grid(alpha=0.3)
    lines = [panels[0].plot([], color=f"C{k}")[0] for k in range(len(rules))]
    figure.legend(lines, rules, loc="outside upper center", ncols=len(rules), frameon=False)
    figure.supxlabel("steps / |V|   (dot: all states seen, mean)", fontsize="medium")
    figure.supylabel("states seen, %", fontsize="medium")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=100)
