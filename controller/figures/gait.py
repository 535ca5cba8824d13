"""Pictures of a gait: the body at six phases of a cycle, from above and from the side."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.figures.style import BLUE, GREY, INK, RED, save_picture, style
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.kinematics.virtual_chassis import virtual_chassis
from snakewalk.drivers.types import BodyPose

PHASES = 6


def bodies_m(gait: Gait, robot: RobotConfig, phases: int = PHASES) -> Floats:
    """(phases, L, 3) link centres in the virtual chassis, over one cycle."""
    yaw = robot.yaw_joints
    pose = BodyPose(0.0, np.zeros(3), np.eye(3))
    joints = gait.joints_rad(robot, np.linspace(0.0, 2.0 * np.pi, 12 * phases, endpoint=False))
    frame: Frame | None = None
    shown = []
    for k, row in enumerate(joints):
        link_m = body_in_world(robot, pose, row).link_m
        frame = virtual_chassis(link_m, np.array([0.0, 0.0, 1.0]), frame)
        if k % 12 == 0:
            shown.append(frame.to_local_m(link_m))
    bodies = np.array(shown)
    reach = np.abs(joints).max(axis=0)
    sideways, upwards = (reach[list(j)].max(initial=0.0) for j in (yaw, robot.pitch_joints))
    # the chassis lies in the plane of the strongest bends: stand it up where these lift
    return bodies[..., [0, 2, 1]] * [1, -1, 1] if upwards > 1.5 * sideways else bodies


def draw_gait(gait: Gait, robot: RobotConfig, path: Path) -> None:
    """Draw the strip into ``path``."""
    bodies = bodies_m(gait, robot)
    length = robot.length_m
    span = 0.56 * length
    wide, tall = (
        max(0.06 * length, float(np.abs(bodies[..., axis]).max()) + 0.04 * length)
        for axis in (1, 2)
    )
    stretch = 3.0 if tall < 0.12 * length else 1.0
    panel_in = 1.75 / (2.0 * span)
    heights = [2.0 * wide * panel_in, 2.0 * tall * stretch * panel_in]
    with style():
        figure = Figure(figsize=(11.0, sum(heights) + 1.0), layout="constrained")
        rows = figure.subplots(2, PHASES, squeeze=False, gridspec_kw={"height_ratios": heights})
        for k, body in enumerate(bodies):
            for axes, axis, half in ((rows[0][k], 1, wide), (rows[1][k], 2, tall)):
                line = body[:, [0, axis]]
                pieces = np.stack([line[:-1], line[1:]], axis=1)
                axes.add_collection(
                    LineCollection(
                        list(pieces), colors=BLUE, linewidths=np.linspace(4.5, 2.0, len(pieces)),
                        capstyle="round",
                    )
                )  # fmt: skip
                axes.plot(*line[0], "o", color=RED, markersize=6, zorder=4)
                axes.set_xlim(-span, span)
                axes.set_ylim(-half, half)
                axes.set_aspect(stretch if axis == 2 else 1.0)
                axes.grid(visible=False)
                axes.set_xticks([])
                axes.set_yticks([])
                for spine in axes.spines.values():
                    spine.set_visible(False)
                axes.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
            rows[0][k].set_title(f"{k}/{PHASES}" if k else "phase 0", color=INK)
        rows[0][0].set_ylabel("above")
        side = "side" if stretch == 1.0 else f"side, {stretch:.0f} x"
        rows[1][0].set_ylabel(side)
        figure.suptitle(f"{gait.name} on {robot.name}", x=0.01, ha="left", fontweight="bold")
        path.parent.mkdir(parents=True, exist_ok=True)
        save_picture(figure, path, dpi=110)
