"""Pictures of a gait: the body at six phases of a cycle, from above and from the side."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import AMBER, BLUE, GREY, HEAD, PALE
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.kinematics.virtual_chassis import virtual_chassis
from snakewalk.drivers.types import BodyPose

PHASES = 6
BACK_TO_BELLY = LinearSegmentedColormap.from_list("back to belly", [BLUE, PALE, AMBER])


class Bodies(NamedTuple):
    """Bodies in the virtual chassis over one cycle."""

    link_m: Floats
    """(phases, L, 3) link centres; columns: forward, left, up."""
    up: Floats
    """(phases, L) vertical part of the direction in which the back of each link points, -1 to 1."""
    rolled_m: float
    """Distance to the left in a cycle of a body that rolls; 0 for other gaits."""


def bodies_m(gait: Gait, robot: RobotConfig) -> Bodies:
    """Bodies at some phases of a cycle."""
    yaw = robot.yaw_joints
    pose = BodyPose(0.0, np.zeros(3), np.eye(3))
    joints = gait.joints_rad(robot, np.linspace(0.0, 2.0 * np.pi, 12 * PHASES, endpoint=False))
    frame: Frame | None = None
    shown = []
    backs = []
    rolls = []
    for k, row in enumerate(joints):
        body = body_in_world(robot, pose, row)
        frame = virtual_chassis(body.link_m, np.array([0.0, 0.0, 1.0]), frame)
        back = body.rotation[robot.link_count // 2, :, 2] @ frame.rotation
        rolls.append(np.arctan2(-back[1], back[2]))
        if k % 12 == 0:
            shown.append(frame.to_local_m(body.link_m))
            backs.append(body.rotation[:, :, 2] @ frame.rotation)
    bodies = np.array(shown)
    back = np.array(backs)
    turned = np.unwrap([*rolls, rolls[0]])
    rolled_m = -robot.body_radius_m * (turned[-1] - turned[0])
    reach = np.abs(joints).max(axis=0)
    sideways, upwards = (reach[list(j)].max(initial=0.0) for j in (yaw, robot.pitch_joints))
    # the chassis lies in the plane of the strongest bends: stand it up where these lift
    if upwards > 1.5 * sideways:
        return Bodies(bodies[..., [0, 2, 1]] * [1, -1, 1], back[..., 1], 0.0)
    bodies[..., 1] += rolled_m * np.arange(PHASES)[:, None] / PHASES
    return Bodies(bodies, back[..., 2], rolled_m)


def draw_gait(gait: Gait, robot: RobotConfig, path: Path) -> None:
    """Draw the strip into ``path``."""
    bodies = bodies_m(gait, robot)
    length = robot.length_m
    span = 0.56 * length
    wide, tall = (
        max(0.06 * length, float(np.abs(bodies.link_m[..., axis]).max()) + 0.04 * length)
        for axis in (1, 2)
    )
    stretch = 3.0 if tall < 0.12 * length else 1.0
    columns = PHASES // 2
    panel_in = (WIDTH_IN - 1.0) / columns / (2.0 * span)
    heights = [2.0 * wide * panel_in, 2.0 * tall * stretch * panel_in] * 2
    with style():
        figure = Figure(figsize=(WIDTH_IN, sum(heights) + 2.4), layout="constrained")
        panels = figure.subplots(
            4, columns, squeeze=False, sharex=True, gridspec_kw={"height_ratios": heights}
        )
        for k in range(PHASES):
            row, column = divmod(k, columns)
            for part, (axis, half) in enumerate(((1, wide), (2, tall))):
                axes = panels[2 * row + part][column]
                _body(axes, bodies.link_m[k][:, [0, axis]], bodies.up[k])
                axes.set_xlim(-span, span)
                axes.set_ylim(-half, half)
                axes.set_aspect(stretch if axis == 2 else 1.0)
                axes.xaxis.set_major_locator(MaxNLocator(3))
                axes.yaxis.set_major_locator(MaxNLocator(2, symmetric=True))
                if column > 0:
                    axes.set_yticklabels([])
            above = panels[2 * row][column]
            above.set_title(f"{k}/{PHASES} of the cycle")
            if bodies.rolled_m:
                way_m = (0.0, bodies.rolled_m), (0.0, 0.0)
                above.annotate("", *way_m, arrowprops={"arrowstyle": "->"})
        side = "up (m)" if stretch == 1.0 else f"up (m), {stretch:.0f} x"
        for row in (0, 2):
            panels[row][0].set_ylabel("left (m)")
            panels[row + 1][0].set_ylabel(side)
        for axes in panels[3]:
            axes.set_xlabel("forward (m)")
        marks = [
            Line2D([], [], color=BLUE, linewidth=4, label="back up"),
            Line2D([], [], color=AMBER, linewidth=4, label="belly up"),
            Line2D([], [], color=HEAD, marker="o", linestyle="", label="head"),
        ]
        rolls = f", rolls {abs(bodies.rolled_m):.2f} m a cycle without slip"
        figure.legend(handles=marks, loc="outside lower center", ncols=3)
        figure.suptitle(
            f"{gait.name} on {robot.name}" + rolls * bool(bodies.rolled_m),
            x=0.01,
            ha="left",
            fontweight="bold",
        )
        save_picture(figure, path, dpi=110)


def _body(axes: Axes, line: Floats, up: Floats) -> None:
    """Draw a body (L, 2), blue where its back is up, amber where its belly is."""
    pieces = np.stack([line[:-1], line[1:]], axis=1)
    colours = [BACK_TO_BELLY(0.5 - 0.5 * float(upward_share)) for upward_share in up[:-1]]
    widths = np.linspace(4.5, 2.0, len(pieces)).tolist()
    axes.add_collection(
        LineCollection(list(pieces), colors=colours, linewidths=widths, capstyle="round")
    )
    axes.plot(*line[0], "o", color=HEAD, markersize=6, zorder=4)
    axes.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
