"""Pictures of a repertoire: the actions' displacements, and a planned and a measured route."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import ASKED, BLUE, CENTRE, GOAL, GREY, INK, MEASURED, SKY
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_run import RepertoireRun
from snakewalk.controller.repertoire.replay import replay
from snakewalk.controller.repertoire.schedule_run import PlayedAction, ScheduleRun
from snakewalk.controller.repertoire.segment import Segment
from snakewalk.controller.runlog.record import RunRecord

BEGIN = GREY
ONE = SKY
TWO = BLUE
"""Bodies at the beginning, after one cycle, and after two."""
_COLUMNS = 3


def draw_actions(repertoire: Repertoire, path: Path) -> None:
    """Draw two cycles of each action to one scale: bodies and the track of the centre.

    A brake is played once, so it has one cycle.
    """
    drawn = [
        _cycles(segment, 1 if segment.kind == "brake" else 2) for segment in repertoire.segments
    ]
    points = np.concatenate([body for _, bodies in drawn for body in bodies])
    low, high = points.min(axis=0) - 0.1, points.max(axis=0) + 0.1
    rows = -(-len(drawn) // _COLUMNS)
    tall = 0.27 * WIDTH_IN * (high - low)[1] / (high - low)[0] + 0.7
    with style():
        figure = Figure(figsize=(WIDTH_IN, rows * tall + 0.6), layout="constrained")
        panels = figure.subplots(rows, _COLUMNS, squeeze=False, sharex=True, sharey=True)
        for axes in panels.ravel()[len(drawn) :]:
            axes.set_axis_off()
        for axes, segment, (track, bodies) in zip(
            panels.ravel(), repertoire.segments, drawn, strict=False
        ):
            labels = ("at the start", "after one cycle", "after two")
            for body, colour, label in zip(bodies, (BEGIN, ONE, TWO), labels, strict=False):
                axes.plot(*body.T, color=colour, lw=2.5, solid_capstyle="round", label=label)
                axes.plot(*body[0], "o", color=colour, ms=5)
            axes.plot(*track.T, color=INK, lw=0.9, ls=":", label="centre of the body")
            turn = round(np.rad2deg(segment.turn_rad_s * segment.duration_s))
            axes.set_title(
                f"{segment.name}\n{segment.speed_m_s:.2f} m/s, {turn:+d}° in "
                f"{segment.duration_s:.2f} s",
                fontsize=9,
            )
            axes.set_xlim(low[0], high[0])
            axes.set_ylim(low[1], high[1])
            axes.set_aspect("equal")
        for axes in panels[:, 0]:
            axes.set_ylabel("y (m)")
        for k, axes in enumerate(panels.ravel()[: len(drawn)]):
            if k + _COLUMNS >= len(drawn):
                axes.set_xlabel("x (m); dots are heads")
                axes.tick_params(labelbottom=True)
        handles, labels_shown = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels_shown, loc="outside upper center", ncols=4)
        save_picture(figure, path, dpi=110)


def _cycles(segment: Segment, cycles: int) -> tuple[Floats, list[Floats]]:
    """Track (n, 2) of the centre, and bodies (L, 2) at the start and after each cycle."""
    frame = Frame.flat(0.0, 0.0, 0.0)
    bodies = [frame.to_world_m(segment.link_m[-1])]
    tracks = []
    for _ in range(cycles):
        played = replay(segment, frame)
        tracks.append(played.origin_m)
        bodies.append(played.link_m[-1])
        frame = played.end
    return np.concatenate(tracks)[:, :2], [body[:, :2] for body in bodies]


def draw_route(job: RepertoireRun, record: RunRecord, path: Path) -> None:
    """Draw the route as planned, and where the centre of the body went."""
    pose = job.route.pose
    planned = []
    for placement, action in zip(pose, job.route.actions, strict=False):
        planned.append(replay(job.repertoire.segments[action], Frame.flat(*placement)).origin_m)
    track = np.concatenate(planned)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 3.6), layout="constrained")
        axis = figure.subplots()
        axis.plot(track[:, 0], track[:, 1], color=GOAL, lw=1.4, label="predicted, all actions")
        axis.plot(pose[:, 0], pose[:, 1], "o", color=GOAL, ms=4, label="ends of cycles")
        label = "simulated, planned again each cycle" if job.replan else "simulated, open loop"
        axis.plot(*record.pose.centre_m[:, :2].T, color=CENTRE, lw=1.4, label=label)
        for k, (x, y) in enumerate(job.run.waypoints_m, start=1):
            ring = Circle((x, y), job.run.waypoint_radius_m, fill=False, edgecolor=GREY)
            axis.add_patch(ring)
            top = (x, y + job.run.waypoint_radius_m)
            axis.annotate(str(k), top, ha="center", va="bottom", fontsize=9, color=INK)
        axis.set_aspect("equal")
        axis.set_xlabel("x (m)")
        axis.set_ylabel("y (m)")
        figure.legend(loc="outside lower center", ncols=3)
        save_picture(figure, path, dpi=110)


def draw_schedule(job: ScheduleRun, played: Sequence[PlayedAction], path: Path) -> None:
    """Draw requested speed and turn over time, those of the chosen actions, and the body's own."""
    names = [segment.name for segment in job.repertoire.segments]
    end_s = played[-1].begin_s + job.repertoire.segments[played[-1].action].duration_s
    fine_s = np.linspace(0.0, end_s, 500)
    requested = np.array([job.requested(t) for t in fine_s])
    edges_s = [*(action.begin_s for action in played), end_s]
    parts = (("recorded", "of the action, recorded", GOAL), ("measured", "of the body", MEASURED))
    used = [name for k, name in enumerate(names) if any(step.action == k for step in played)]
    with style():
        figure = Figure(figsize=(WIDTH_IN, 4.6 + 0.22 * len(used)), layout="constrained")
        speed, turn, chosen = figure.subplots(
            3, 1, sharex=True, height_ratios=[1.0, 1.0, 0.3 + 0.12 * len(used)]
        )
        labels = ("speed (m/s)", "turn (rad/s)")
        for axis, which, name in zip((speed, turn), (0, 1), labels, strict=True):
            axis.plot(fine_s, requested[:, which], color=ASKED, lw=2.5, label="requested")
            for key, label, colour in parts:
                values = [getattr(action, key)[which] for action in played]
                axis.stairs(values, edges_s, color=colour, lw=1.4, label=label, baseline=None)
            axis.set_ylabel(name)
        for step, last_s in zip(played, edges_s[1:], strict=True):
            row = used.index(names[step.action])
            chosen.plot([step.begin_s, last_s], [row, row], color=INK, lw=5, solid_capstyle="butt")
        chosen.set_yticks(range(len(used)), used)
        chosen.set_ylim(len(used) - 0.4, -0.6)
        chosen.set_ylabel("action")
        chosen.set_xlabel("time (s)")
        handles, labels_shown = speed.get_legend_handles_labels()
        figure.legend(handles, labels_shown, loc="outside upper center", ncols=3)
        save_picture(figure, path, dpi=110)
