"""A synthesised animal with legs: its way and footfalls, contacts over a few cycles, its height."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.colours import AMBER, BLUE, GREEN, GREY, INK, PURPLE, SKY
from snakewalk.controller.animals.legged.animal_synthesis import SynthesisedAnimal
from snakewalk.controller.animals.legged.prototype import LEGS, footfall, printed_feet
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.path import draw_ground
from snakewalk.controller.figures.style import WIDTH_IN, legend_above, save_picture, style
from snakewalk.controller.kinematics.arc_length import arc_lengths

_MARGIN_M = 0.3
_CYCLES = 4
_BODIES = 9
_LEG_COLOURS = BLUE, SKY, PURPLE, AMBER


def draw_animal(animal_motion: SynthesisedAnimal, file: Path, title: str) -> None:
    """Draw the motion to ``file``.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    plan = np.concatenate(
        [animal_motion.motion.spine_m[..., :2].reshape(-1, 2), animal_motion.waypoints_m]
    )
    low, high = plan.min(axis=0) - _MARGIN_M, plan.max(axis=0) + _MARGIN_M
    map_in = float(np.clip(0.9 * WIDTH_IN * (high - low)[1] / (high - low)[0], 2.6, 6.0))
    with style():
        figure = Figure(figsize=(WIDTH_IN, map_in + 6.4), layout="constrained", dpi=110)
        upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[map_in, 6.4])[:, 0]
        axes = upper.subplots(1, 1)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        _map(axes, animal_motion, title)
        chart, feet, height = lower.subplots(3, 1, height_ratios=[1.0, 1.3, 1.3])
        _contacts(chart, animal_motion)
        _feet(feet, animal_motion.animal)
        _heights(height, animal_motion)
        save_picture(figure, file)


def _map(axes: Axes, animal_motion: SynthesisedAnimal, title: str) -> None:
    if animal_motion.ground is not None:
        draw_ground(axes, animal_motion.ground)
    axes.set_aspect("equal", anchor="N")
    path_m = animal_motion.path.position(np.linspace(0.0, animal_motion.path.length_m, 400))
    axes.plot(*path_m.T, color=INK, linewidth=1.2, linestyle=(0, (5, 3)), label="planned path")
    motion = animal_motion.motion
    for k, (leg, colour) in enumerate(zip(LEGS, _LEG_COLOURS, strict=True)):
        down = np.flatnonzero(np.diff(motion.on_ground[:, k].astype(int)) == 1) + 1
        axes.plot(
            *motion.foot_m[down, k, :2].T, ".", color=colour, markersize=4.0, label=f"{leg} foot"
        )
    for frame in np.linspace(0, len(motion.time_s) - 1, _BODIES).astype(int):
        _body(axes, animal_motion, int(frame))
    for number, point in enumerate(animal_motion.waypoints_m, start=1):
        axes.add_patch(
            Circle(tuple(point), animal_motion.waypoint_radius_m, fill=False, color=GREEN)
        )
        axes.annotate(str(number), tuple(point), color=GREEN, fontweight="bold")
    axes.set_title(title, pad=36.0)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    legend_above(axes, 3)


def _body(axes: Axes, animal_motion: SynthesisedAnimal, frame: int) -> None:
    motion = animal_motion.motion
    axes.plot(*motion.spine_m[frame, :, :2].T, color=INK, linewidth=2.0)
    for k in range(len(LEGS)):
        axes.plot(*motion.joints_m[k][frame, :, :2].T, color=INK, linewidth=1.0)


def _contacts(axes: Axes, animal_motion: SynthesisedAnimal) -> None:
    """[KP] Fig. 13 (b): which feet are on the ground."""
    motion = animal_motion.motion
    cycle_s = animal_motion.animal.cycle_s
    shown = motion.time_s <= _CYCLES * cycle_s
    cycles = motion.time_s[shown] / cycle_s
    for k, colour in enumerate(_LEG_COLOURS):
        row = np.where(motion.on_ground[shown, k], float(k), np.nan)
        axes.plot(cycles, row, color=colour, linewidth=7.0, solid_capstyle="butt")
    axes.set_yticks(range(len(LEGS)), LEGS)
    axes.set_ylim(len(LEGS) - 0.4, -0.6)
    axes.set_ylabel("foot")
    axes.set_title("on the ground")
    axes.set_xlabel("cycles")


def _feet(axes: Axes, animal: AnimalConfig) -> None:
    """Paths of the front feet over a cycle, seen from the trunk: ours, and [GC] Eq. 9-10."""
    pair = animal.leg_pairs[0]
    length_m = animal.length_m
    cycles = np.linspace(0.0, 1.0, 241)
    phase = (cycles[:, None] - [pair.left, pair.right]) % 1.0
    ahead, rise, _ = footfall(animal, pair, phase)
    order = np.argsort(phase[:, 0])
    axes.plot(100.0 * ahead[order, 0], 100.0 * rise[order, 0], color=BLUE, label="footfall (ours)")
    ahead, rise, _ = printed_feet(animal, pair, cycles)
    axes.plot(
        100.0 * ahead[:, 0],
        100.0 * rise[:, 0],
        color=AMBER,
        linestyle="--",
        label="gc-printed: [GC] Eq. 9-10",
    )
    for k, label in ((0, "left foot: forward while low"), (1, "right foot: back while low")):
        x = 55.0 * float(np.abs(ahead).max()) * (1.0 - 2.0 * k)
        arrow = {"arrowstyle": "->", "color": AMBER, "linewidth": 1.4}
        axes.annotate("", (x, 0.0), (0.0, 0.0), arrowprops=arrow)
        alignment = "left" if k == 0 else "right"
        axes.text(1.05 * x, 0.0, f" {label} ", color=INK, ha=alignment, va="bottom", fontsize=8.0)
    axes.set_xlabel("ahead of the middle of a step (cm)")
    axes.set_ylabel("height (cm)")
    axes.set_ylim(-0.15 * 100.0 * length_m * pair.lift, 1.25 * 100.0 * length_m * pair.lift)
    legend_above(axes, 2)


def _heights(axes: Axes, animal_motion: SynthesisedAnimal) -> None:
    motion = animal_motion.motion
    middle = animal_motion.middle_m
    along = arc_lengths(middle)
    ground: Floats = np.zeros(len(middle))
    if animal_motion.ground is not None:
        ground = animal_motion.ground.elevation_m(*middle.T)
    axes.fill_between(along, ground, ground.min() - 0.02, color=GREY, alpha=0.35, linewidth=0)
    axes.plot(along, motion.hip_m[..., 2].mean(axis=1), color=BLUE, label="roots of the legs, mean")
    axes.plot(along, ground, color=INK, linewidth=1.0, label="ground below them")
    axes.set_xlabel("distance along the track of the trunk (m)")
    axes.set_ylabel("height (m)")
    legend_above(axes, 2)
