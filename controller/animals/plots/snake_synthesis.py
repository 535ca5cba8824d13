"""A synthesised motion as [PT] shows it: trajectory, distance to the target, speed, states."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import (
    AMBER,
    BLUE,
    CENTRE,
    GREEN,
    GREY,
    HEAD,
    INK,
    PATH,
    PURPLE,
    REACHED,
    RED,
    SKY,
    TO_COME,
)
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.animals.synthesis.snake_synthesis import SynthesisedWalk
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.path import draw_ground
from snakewalk.controller.figures.style import (
    ANGLES,
    TIMES,
    WIDTH_IN,
    legend_above,
    save_picture,
    style,
)
from snakewalk.controller.kinematics.arc_length import arc_lengths

_BODY_SPACING = 1.15
"""Body lengths between the bodies drawn."""
_MARGIN_M = 0.4
_LONGEST_SOURCE = 36
"""Characters of the source of the tongue's chain that fit below its axes."""


def draw_walk(walk: SynthesisedWalk, ground: HeightField | None, file: Path, title: str) -> None:
    """Draw a synthesis ([PT] Fig. 10 and 11) to ``file``.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    low, high = _extent(walk)
    wide, tall = high - low
    map_in = float(np.clip(0.9 * WIDTH_IN * tall / wide + 1.1, 2.8, 6.0))
    with style():
        figure = Figure(figsize=(WIDTH_IN, map_in + 8.6), layout="constrained", dpi=110)
        upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[map_in, 8.6])[:, 0]
        axes = upper.subplots(1, 1)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        _map(axes, walk, ground, title)
        _over_time(lower.subplots(4, 2, sharex=True).T.ravel(), walk)
        save_picture(figure, file)


def _extent(walk: SynthesisedWalk) -> tuple[Floats, Floats]:
    """Corners (2,) of the drawing in plan."""
    ends = walk.path.position(np.linspace(0.0, walk.path.length_m, 400))
    points = np.concatenate([walk.skeleton.points_m[..., :2].reshape(-1, 2), ends])
    return points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M


def _map(axes: Axes, walk: SynthesisedWalk, ground: HeightField | None, title: str) -> None:
    """Path, targets, sampled skeletons and the track of the mass centre."""
    points = walk.skeleton.points_m[..., :2]
    centre = points.mean(axis=1)
    targets = walk.targets
    path_m = walk.path.position(np.linspace(0.0, walk.path.length_m, 400))
    axes.plot(*path_m.T, color=PATH, linewidth=1.2, linestyle=(0, (5, 3)), label="planned path")
    axes.plot(*centre.T, color=CENTRE, linewidth=1.6, label="mass centre")
    along = arc_lengths(centre)
    marks = np.arange(0.0, along[-1], _BODY_SPACING * walk.length_m)
    some = np.unique(np.append(np.searchsorted(along, marks), len(points) - 1))
    bodies = LineCollection(
        list(points[some]), cmap=TIMES, linewidths=2.6, capstyle="round", zorder=3
    )
    bodies.set_array(some / walk.rate_hz)
    axes.add_collection(bodies)
    axes.plot(*points[some, 0].T, "o", color=HEAD, markersize=3.5, zorder=4)
    between = targets.points_m[~targets.required]
    axes.plot(*between.T, ".", color=GREY, markersize=5, label="targets between")
    number = np.cumsum(targets.required)
    for k in np.flatnonzero(targets.required):
        colour = REACHED if k < targets.index else TO_COME
        x, y = targets.points_m[k]
        ring = Circle((x, y), targets.radius_m, fill=False, edgecolor=colour, linewidth=1.6)
        axes.add_patch(ring)
        axes.text(x, y, str(number[k]), color=colour, ha="center", va="center", weight="bold")
    if ground is not None:
        x, y = axes.get_xlim(), axes.get_ylim()
        draw_ground(axes, ground)
        axes.set_xlim(x)
        axes.set_ylim(y)
    axes.set_aspect("equal", anchor="N")
    axes.set_xlabel("x (m); bodies darker with time, dots are heads")
    axes.set_ylabel("y (m)")
    axes.set_title(title, pad=24.0)
    legend_above(axes, 3)


def _over_time(panels: Sequence[Axes], walk: SynthesisedWalk) -> None:
    """Distance, states, angles, behaviour; speed and bends, heading, head movement, tongue."""
    distance, states, angles, behaviour, speed, heading, head, tongue = panels
    time = walk.time_s
    targets = walk.targets
    end = len(targets.distance_m)
    current = np.minimum(targets.current, targets.count - 1)
    passed = np.flatnonzero(np.diff(current, prepend=current[0]))
    for axes in (distance, speed, states):
        for k in passed:
            if targets.required[max(current[k] - 1, 0)]:
                axes.axvline(time[k], color=GREEN, linewidth=0.8, alpha=0.6)
    distance.plot(time[:end], targets.distance_m, color=INK)
    distance.axhline(targets.radius_m, color=GREY, linewidth=0.8, linestyle="--")
    distance.set_ylim(bottom=0.0)
    distance.set_ylabel("m")
    distance.set_title("mass centre to target; dashed: radius")
    speed.plot(time, walk.plan.speed_m_s, color=BLUE)
    speed.set_ylim(bottom=0.0)
    speed.set_ylabel("m/s", color=BLUE)
    speed.set_title("speed (line), bend K (dotted)")
    bends = speed.twinx()
    bends.plot(time, walk.plan.angles_rad.std(axis=1), color=AMBER, linestyle=":")
    bends.set_ylim(bottom=0.0)
    bends.set_ylabel("rad", color=AMBER)
    bends.grid(visible=False)
    _states(states, walk)
    _behaviour(behaviour, walk)
    swing = walk.plan.angles_rad - walk.plan.angles_rad.mean(axis=1, keepdims=True)
    most = float(np.abs(swing).max())
    angles.imshow(
        swing[:: max(1, len(time) // 600)].T,
        aspect="auto",
        cmap=ANGLES,
        vmin=-most,
        vmax=most,
        extent=(0.0, float(time[-1]), 1.0, 0.0),
    )
    angles.grid(visible=False)
    angles.set_yticks([0.0, 1.0], ["head", "tail"])
    angles.set_title(f"angle about the heading; to ±{most:.1f} rad")
    angles.set_ylabel("body")
    mean = np.unwrap(walk.plan.angles_rad.mean(axis=1))
    heading.plot(time, np.degrees(mean), color=BLUE)
    heading.set_title("heading: mean angle of the body")
    heading.set_ylabel("degrees")
    aside = walk.plan.angles_rad[:, 0] - walk.plan.angles_rad.mean(axis=1)
    head.plot(time, np.degrees(aside), color=PURPLE)
    head.set_title("head movement: angle to the heading")
    head.set_ylabel("degrees")
    behaviour.set_xlabel("time (s)")
    tongue.plot(time, walk.tongue, color=RED, linewidth=0.8)
    tongue.set_title("tongue: 0 in, 1 out")
    tongue.set_ylabel("share")
    learned_from = textwrap.shorten(walk.tongue_evidence, _LONGEST_SOURCE, placeholder=" ...")
    tongue.set_xlabel(f"time (s)\nlearned from: {learned_from}")
    tongue.set_xlim(0.0, time[-1])


def _states(axes: Axes, walk: SynthesisedWalk) -> None:
    time = walk.time_s
    frame_indices, state = np.array(walk.states).T
    shown = np.append(state, state[-1])
    axes.step(
        np.append(time[frame_indices], time[-1]), shown, color=PURPLE, where="post", linewidth=1.0
    )
    axes.plot(time[frame_indices], state, "o", color=PURPLE, markersize=3)
    axes.set_title(f"state, {len(set(state))} of {len(walk.library.shapes_rad)} used")
    axes.set_ylabel("number")


def _behaviour(axes: Axes, walk: SynthesisedWalk) -> None:
    """Draw sliding, head and tail as shares, and the pulse on an axis of its own."""
    time = walk.time_s
    axes.plot(time, walk.sliding.mean(axis=1), color=RED, label="sliding")
    axes.plot(time, walk.head_held, color=GREEN, linestyle="--", label="head held")
    axes.plot(time, walk.calm_tail, color=SKY, linestyle="-.", label="calm tail")
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.set_ylim(-0.05, 1.6)
    axes.set_ylabel("share")
    axes.set_title("behaviour; dotted: pulse g")
    axes.legend(fontsize=8.5, ncols=3, loc="upper right", columnspacing=0.7, handlelength=1.2)
    pulse = axes.twinx()
    pulse.plot(time, walk.pulse_m_s.mean(axis=1), color=INK, linestyle=":")
    pulse.grid(visible=False)
    pulse.set_ylabel("m/s")
