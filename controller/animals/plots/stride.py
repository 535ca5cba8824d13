"""The stride of a tracked animal: the way of each foot over the cycle, and when it stands."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.colours import BLUE, GREY, INK
from snakewalk.controller.animals.legged.prototype import LEGS
from snakewalk.controller.animals.legged.stride import Stride, model_ahead
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style


def draw_stride(stride: Stride, file: Path, title: str) -> None:
    """Draw the fit of each foot to ``file``.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 6.0), layout="constrained", dpi=110)
        panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
        for k, axes in enumerate(panels):
            _foot(axes, stride, k)
        for axes in panels[2:]:
            axes.set_xlabel("cycles since front left touched down")
        for axes in panels[::2]:
            axes.set_ylabel("ahead of girdle (body lengths)")
        figure.suptitle(title)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        save_picture(figure, file)


def _foot(axes: Axes, stride: Stride, k: int) -> None:
    """Every cycle as dots, the model as a line, grey where the foot is on the ground."""
    foot = stride.feet[k]
    cycle = np.linspace(0.0, 1.0, 401)
    on = (cycle - foot.down) % 1.0 < foot.duty
    low, high = np.nanmin(stride.ahead), np.nanmax(stride.ahead)
    axes.fill_between(
        cycle, low, high, where=on, color=GREY, alpha=0.25, linewidth=0, label="on the ground"
    )
    axes.plot(
        stride.phase % 1.0, stride.ahead[:, k], ".", color=BLUE, markersize=3.0, label="tracked"
    )
    axes.plot(cycle, model_ahead(stride, k, cycle), color=INK, linewidth=1.2, label="model")
    down = round(foot.down, 2) % 1.0  # 0.998 is 0.00, not 1.00
    axes.set_title(f"{LEGS[k]}: {100.0 * foot.duty:.0f} % on the ground, down at {down:.2f}")
