"""The walk over the library of shapes: which, how many, and how well they fitted the aim."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from snakewalk.config.arrays import Bools, Ints
from snakewalk.config.colours import AMBER, BLUE, GREEN, GREY, PALE, RED
from snakewalk.controller.figures.style import canvas, legend_above
from snakewalk.controller.runlog.record import RunRecord

_MARKS = 4000
"""Decisions from which marks are drawn as one picture (ours): 4 MB of the page otherwise."""
_ABOVE = 10
"""Drawing order above all marks."""


def walk_figure(record: RunRecord) -> Figure | None:
    """Draw states over decisions, and heading errors; None without a decision."""
    walk = record.walk
    steps = len(walk.time_s)
    if steps == 0:
        return None
    has_states = len(np.unique(walk.state)) > 1
    number = np.arange(1, steps + 1)
    figure, panels = canvas(2 if has_states else 1, 5.4 if has_states else 3.0)
    for axes in panels if steps > _MARKS else ():
        axes.set_rasterization_zorder(_ABOVE)
    if has_states:
        states = panels[0]
        states.plot(number, walk.state, color=PALE, linewidth=0.8, zorder=1)
        size = float(np.clip(1800 / steps, 6, 26))
        for chosen, colour, label in zip(
            _kinds_of_decision(walk.state),
            (GREEN, BLUE, AMBER),
            ("started", "continued", "repeated"),
            strict=True,
        ):
            states.scatter(
                number[chosen], walk.state[chosen], s=size, color=colour, label=label, zorder=2
            )
        states.set_ylabel("state")
        states.set_title("States of the walk")
        legend_above(states)
        count = states.twinx()
        count.plot(number, walk.visited, color=BLUE, linewidth=1.4)
        count.set_ylabel("distinct states visited", color=BLUE)
        count.tick_params(axis="y", colors=BLUE)
        count.set_ylim(bottom=0)
        count.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
        count.grid(visible=False)
    aim = panels[-1]
    aim.axhline(0.0, color=GREY, linewidth=0.8)
    aim.plot(
        number,
        walk.heading_error_rad,
        color=BLUE,
        linewidth=1.0,
        marker=".",
        markersize=4,
        label="heading error of the shape",
    )
    aim.plot(number, walk.ramp_rad, color=AMBER, linewidth=1.0, label="bend added against it")
    none = walk.candidates == 0
    if has_states and none.any():
        aim.scatter(
            number[none],
            walk.heading_error_rad[none],
            s=28,
            facecolor="none",
            edgecolor=RED,
            label="no shape within the tolerance",
            zorder=3,
        )
    aim.set_ylabel("angle (rad)")
    aim.set_title("Aim")
    aim.set_xlabel("decision")
    aim.set_xlim(0, steps + 1)
    aim.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend_above(aim)
    return figure


def _kinds_of_decision(state: Ints) -> tuple[Bools, Bools, Bools]:
    """Return which decisions (n,) start a state, continue that before, or repeat an earlier one."""
    _, first = np.unique(state, return_index=True)
    starts = np.isin(np.arange(len(state)), first)
    continues = np.append(False, state[1:] == state[:-1])
    return starts, continues, ~starts & ~continues
