"""A picture of a map from above: heights, unknown places, and safe ground."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from snakewalk.config.colours import BLUE, INK
from snakewalk.controller.figures.path import draw_ground
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.terrain.relief import Relief


def draw_terrain_map(relief: Relief, file: Path, title: str) -> None:
    """Draw a map: hatched where unknown, blue where a path may go."""
    ground = relief.ground
    w, h = ground.size_m
    index_width = WIDTH_IN
    with style():
        tall_in = float(np.clip(0.8 * index_width * h / w, 3.0, 8.5)) + 1.2
        figure = Figure(figsize=(index_width, tall_in), layout="constrained", dpi=110)
        axes = figure.subplots(1, 1)
        draw_ground(axes, ground)
        mesh_m = np.meshgrid(*ground.axes_m)
        is_known = np.ones(ground.z_m.shape, bool) if ground.known is None else ground.known
        safe = relief.safe(*mesh_m)
        marks = [Patch(facecolor=BLUE, alpha=0.35, label="safe for a path")]
        if safe.any():
            axes.contourf(*mesh_m, safe, levels=[0.5, 1.5], colors=[BLUE], alpha=0.35)
        if not is_known.all():
            axes.contourf(*mesh_m, ~is_known, levels=[0.5, 1.5], colors=["white"], alpha=0.75)
            axes.contourf(*mesh_m, ~is_known, levels=[0.5, 1.5], colors=["none"], hatches=["////"])
            marks.append(Patch(facecolor="white", edgecolor=INK, hatch="////", label="unknown"))
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.set_title(title)
        figure.legend(handles=marks, loc="outside lower center", ncols=len(marks), frameon=False)
        save_picture(figure, file)
