"""Pictures of a repertoire: the actions' displacements, and a planned and a measured route."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.controller.figures.style import save_picture
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_run import RepertoireRun
from snakewalk.controller.repertoire.replay import replay
from snakewalk.controller.repertoire.schedule_run import PlayedAction, ScheduleRun
from snakewalk.controller.runlog.record import RunRecord

SHADES = ("0.6", "#2c6fbb", "#c0392b")


def draw_actions(repertoire: Repertoire, path: Path) -> None:
    """Draw two cycles of each action: track of the centre, body at the beginning and the end."""
    figure = Figure(figsize=(9.0, 0.95 * len(repertoire.segments)), layout="constrained")
    axes = figure.subplots(-(-len(repertoire.segments) // 2), 2, squeeze=False).ravel()
    for axis in axes[len(repertoire.segments) :]:
        axis.set_axis_off()
    for axis, segment in zip(axes, repertoire.segments, strict=False):
        begin = Frame.flat(0.0, 0.0, 0.0)
        one = replay(segment, begin)
        two = replay(segment, one.end)
        track = np.concatenate([one.origin_m, two.origin_m])
        first = begin.to_world_m(segment.link_m[-1])
        for shape, shade in zip((first, one.link_m[-1], two.link_m[-1]), SHADES, strict=True):
            axis.plot(shape[:, 0], shape[:, 1], color=shade, lw=2.5, solid_capstyle="round")
            axis.plot(*shape[0, :2], "o", color=shade, ms=5)
        axis.plot(track[:, 0], track[:, 1], color="0.2", lw=0.9, ls=":")
        turn = segment.turn_rad_s * segment.duration_s
        axis.set_title(
            f"{segment.name}: {segment.speed_m_s:.2f} m/s, {turn:+.2f} rad a cycle of "
            f"{segment.duration_s:.2f} s",
            fontsize=8,
        )
        axis.set_aspect("equal")
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.25)
    save_picture(figure, path, dpi=90)


def draw_route(job: RepertoireRun, record: RunRecord, path: Path) -> None:
    """Draw the route as planned, and where the centre of the body went."""
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    axis = figure.subplots()
    pose = job.route.pose
    planned = []
    for at, action in zip(pose, job.route.actions, strict=False):
        planned.append(replay(job.repertoire.segments[action], Frame.flat(*at)).origin_m)
    track = np.concatenate(planned)
    axis.plot(track[:, 0], track[:, 1], color=SHADES[1], lw=1.2, label="predicted, all actions")
    axis.plot(pose[:, 0], pose[:, 1], "o", color=SHADES[1], ms=4, label="ends of cycles")
    found = record.pose.centre_m
    label = "simulated, planned again each cycle" if job.replan else "simulated, without looking"
    axis.plot(found[:, 0], found[:, 1], color=SHADES[2], lw=1.2, label=label)
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    radius = job.run.waypoint_radius_m
    for k, (x, y) in enumerate(job.run.waypoints_m, start=1):
        axis.plot(x + radius * np.cos(angle), y + radius * np.sin(angle), color="0.5", lw=0.8)
        axis.annotate(str(k), (x, y), ha="center", va="center", fontsize=8, color="0.4")
    axis.set_aspect("equal")
    axis.set_xlabel("x, m")
    axis.set_ylabel("y, m")
    axis.grid(alpha=0.25)
    figure.legend(fontsize=8, loc="outside lower center", ncols=3)
    save_picture(figure, path, dpi=90)


def draw_schedule(job: ScheduleRun, played: Sequence[PlayedAction], path: Path) -> None:
    """Draw wanted speed and turn over time, those of the actions chosen, and the body's own."""
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    end_s = played[-1].begin_s + job.repertoire.segments[played[-1].action].duration_s
    fine_s = np.linspace(0.0, end_s, 500)
    requested = np.array([job.requested(t) for t in fine_s])
    edges_s = [*(action.begin_s for action in played), end_s]
    parts = (("recorded", "the action's", SHADES[1]), ("measured", "the body's", SHADES[2]))
    for axis, which, name in zip(axes, (0, 1), ("speed, m/s", "turn, rad/s"), strict=True):
        axis.plot(fine_s, requested[:, which], color=SHADES[0], lw=2.5, label="wanted")
        for key, label, shade in parts:
            values = [getattr(action, key)[which] for action in played]
            axis.stairs(values, edges_s, color=shade, lw=1.2, label=label, baseline=None)
        axis.set_ylabel(name)
        axis.grid(alpha=0.25)
    before = None
    for one in played:
        if one.action != before:
            name = job.repertoire.segments[one.action].name
            axes[0].annotate(
                name, (one.begin_s, 1.02), xycoords=("data", "axes fraction"), fontsize=7,
                rotation=35, va="bottom",
            )  # fmt: skip
        before = one.action
    axes[1].set_xlabel("time, s")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    save_picture(figure, path, dpi=90)
