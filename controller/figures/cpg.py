"""Gait changes by the pattern generator, drawn.

`python -m snakewalk.controller.figures.cpg OUT.png`.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import INK, PALE, SERIES
from snakewalk.config.loader import load_robot
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.motion.cpg_motion import CpgMotion

ROBOT = "alternating16"
GAITS_SHOWN = ("sidewinding", "rolling", "concertina", "lateral-undulation")
STEP_S = 0.02
STAY_S = 5.0
JOINTS_SHOWN = (1, 2, 5, 10)
"""Joints that the figure shows, from the head; odd: yaw, even: pitch. All sixteen would fill the
panels."""


def draw(out: Path) -> None:
    """Draw angles and speeds of four joints over four gaits, and rest."""
    with style():
        _draw(out)


def _draw(out: Path) -> None:
    robot = load_robot(ROBOT)
    origin_frame = body_in_world(robot, pose_at(np.zeros(2), 0.0), np.zeros(robot.joint_count))
    motion = CpgMotion(robot, np.zeros(robot.joint_count))
    angles: list[Floats] = []
    speeds: list[Floats] = []
    changes: list[tuple[float, str, float]] = []
    for name in (*GAITS_SHOWN, ""):
        taken_s = motion.become(GAITS[name]()) if name else motion.stop()
        changes.append((len(angles) * STEP_S, name or "rest", taken_s))
        for _ in range(round((taken_s + (STAY_S if name else 1.0)) / STEP_S)):
            angles.append(motion.step(STEP_S, origin_frame))
            speeds.append(motion.velocity_rad_s())
    time_s = STEP_S * np.arange(len(angles))
    figure = Figure(figsize=(WIDTH_IN, 5.4), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for axis, rows, limit in (
        (axes[0], np.array(angles), max(robot.limit_rad)),
        (axes[1], np.array(speeds), robot.joint_speed_limit_rad_s),
    ):
        for joint, colour in zip(JOINTS_SHOWN, SERIES, strict=False):
            axis.plot(time_s, rows[:, joint - 1], color=colour, lw=0.9, label=f"joint {joint}")
        for bound in (-limit, limit):
            axis.axhline(bound, color=INK, linewidth=0.8, linestyle="--")
        for start_s, _, taken_s in changes:
            axis.axvspan(start_s, start_s + taken_s, color=PALE, alpha=0.6, linewidth=0, zorder=0)
    for start_s, name, _ in changes:
        axes[0].annotate(name, (start_s, 1.02), xycoords=("data", "axes fraction"), fontsize=7.5)
    axes[0].set_ylabel("joint angle (rad)")
    axes[1].set_ylabel("joint speed (rad/s)")
    axes[1].set_xlabel("time (s); grey: change to the next gait; dashed: limits")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    save_picture(figure, out, dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
