"""A synthesised motion: segments in their own frame, the graph of pieces, and the new path."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from snakewalk.config.colours import BLUE, GREEN, GREY, INK, PALE, RED
from snakewalk.controller.animals.fish.fish_synthesis import SynthesisedMotion
from snakewalk.controller.animals.fish.synthesis import junctions
from snakewalk.controller.animals.fish.synthesis_options import SynthesisOptions
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import TIMES, WIDTH_IN, save_picture, style

KINDS = {"glide": GREY, "forward": GREEN, "left": BLUE, "right": RED}
_BODIES = 40


def draw_synthesis(file: Path, motion: SynthesisedMotion, options: SynthesisOptions) -> None:
    """Draw a synthesis to ``file``.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 7.6), layout="constrained", dpi=110)
        upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.0, 1.35])[:, 0]
        left, right = upper.subplots(1, 2, squeeze=False)[0]
        _pieces(left, motion)
        _graph(right, motion)
        _path(lower.subplots(1, 1), motion, options)
        save_picture(figure, file)


def _pieces(axes: Axes, motion: SynthesisedMotion) -> None:
    """Way of the base of the head in each segment, all from one posture."""
    for piece in motion.pieces.pieces:
        axes.plot(piece.base[:, 0], piece.base[:, 1], color=KINDS[piece.kind], linewidth=1.3)
        axes.plot(*piece.base[-1], "o", color=KINDS[piece.kind], markersize=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(f"{len(motion.pieces.pieces)} segments from one posture")
    axes.set_xlabel(f"x ({_unit(motion)})")
    axes.set_ylabel(f"y ({_unit(motion)})")
    handles = [Line2D([], [], color=colour, label=kind) for kind, colour in KINDS.items()]
    axes.legend(handles=handles, loc="upper left")


def _graph(axes: Axes, motion: SynthesisedMotion) -> None:
    """Segments on a ring, a line where one may follow another; used joins dark."""
    pieces = motion.pieces
    count = len(pieces.pieces)
    angle = np.pi / 2 - 2.0 * np.pi * np.arange(count) / count
    place = np.column_stack([np.cos(angle), np.sin(angle)])
    allowed = [(a, b) for a in range(count) for b in pieces.permitted(a)]
    used = list(zip(motion.sequence.order, motion.sequence.order[1:], strict=False))
    for joins, colour, width in ((allowed, PALE, 0.6), (used, INK, 1.1)):
        lines = [np.stack([place[a], 0.25 * (place[a] + place[b]), place[b]]) for a, b in joins]
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=width))
    for k, piece in enumerate(pieces.pieces):
        axes.plot(*place[k], "o", color=KINDS[piece.kind], markersize=7, zorder=3)
        if count <= 24:
            x, y = 1.16 * place[k]
            axes.text(x, y, piece.origin, ha="center", va="center", fontsize=8.5)
    axes.set_xlim(-1.35, 1.35)
    axes.set_ylim(-1.25, 1.25)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title("possible successors (dark: used)")


def _path(axes: Axes, synthesised: SynthesisedMotion, options: SynthesisOptions) -> None:
    """Bodies along the new path, joins as dots, control points as circles."""
    motion = synthesised.motion
    points = motion.points()
    some = np.unique(np.linspace(0, motion.frames - 1, _BODIES).astype(int))
    bodies = LineCollection(list(points[some]), cmap=TIMES, linewidths=2.0, capstyle="round")
    bodies.set_array(some / motion.rate_hz)
    axes.plot(motion.base[:, 0], motion.base[:, 1], color=GREY, linewidth=0.8)
    axes.add_collection(bodies)
    joins = motion.base[junctions(synthesised.pieces, synthesised.sequence)]
    axes.plot(joins[:, 0], joins[:, 1], "o", color=INK, markersize=2.5)
    for k, (x, y, *_) in enumerate(options.through):
        radius = options.radius * synthesised.source.length
        axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=RED, linewidth=1.4))
        axes.text(x, y, str(k + 1), color=RED, ha="center", va="center", weight="bold")
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x ({_unit(synthesised)})")
    axes.set_ylabel(f"y ({_unit(synthesised)})")
    if isinstance(axes.figure, Figure | SubFigure):
        axes.figure.colorbar(bodies, ax=axes, pad=0.02, label="time (s)")
    kind = "through control points" if options.through else "at random"
    axes.set_title(
        f"{synthesised.facts.seconds} s {kind}: {synthesised.facts.pieces_used} segments"
    )


def _unit(motion: SynthesisedMotion) -> str:
    return "body lengths" if motion.source.length_m is None else "m"
