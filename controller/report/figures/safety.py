"""Interventions of the safety layer over time: clamps, vetoes and unanswered reads by joint."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from snakewalk.config.colours import BLUE, FAULT, GREY, INK, REACHED, WARNING
from snakewalk.controller.figures.style import canvas, legend_above, name_joints
from snakewalk.controller.runlog.record import RunRecord

_EVENT_COLOURS = {"info": BLUE, "warning": WARNING, "error": FAULT}


def safety_figure(record: RunRecord) -> Figure | None:
    """Line of events over a raster of joints, if any was held back; None if nothing happened."""
    cycle = record.cycle
    if len(cycle.time_s) == 0 and not record.events:
        return None
    joints = cycle.asked_rad.shape[1]
    calm = bool(cycle.valid.all()) and set(cycle.verdict) <= {"pass"}
    height = float(np.clip(0.09 * joints, 1.4, 2.8))
    if calm:
        figure, panels = canvas(1, 1.8)
    else:
        figure, panels = canvas(2, height + 1.7, ratios=[0.9, height])
        _raster(panels[1], record)
    _line(panels[0], record)
    if calm:
        panels[0].set_title("Events; no command was changed, every read was answered")
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, max(record.end_s, 1e-3))
    return figure


def _line(axes: Axes, record: RunRecord) -> None:
    for event in record.events:
        colour = REACHED if event.kind == "waypoint" else _EVENT_COLOURS.get(event.level, INK)
        row = {"info": 0, "warning": 1, "error": 2}.get(event.level, 0)
        axes.scatter(event.time_s, row, marker="D", s=26, color=colour, zorder=3, clip_on=False)
    axes.set_yticks([0, 1, 2], ["info", "warning", "error"])
    axes.set_ylim(-0.6, 2.6)
    axes.set_ylabel("level")
    axes.set_title("Events")


def _raster(axes: Axes, record: RunRecord) -> None:
    cycle = record.cycle
    for kind, colour in (("clamp", WARNING), ("veto", FAULT)):
        time, joint = _marks(record, kind)
        label = f"{kind} ({cycle.verdict.count(kind)} cycles)"
        axes.scatter(time, joint, marker="s", s=9, linewidths=0, color=colour, label=label)
    rows, columns = np.nonzero(~cycle.valid)
    axes.scatter(
        cycle.time_s[rows], columns, marker=".", s=14, color=GREY, label=f"no answer ({len(rows)})"
    )
    axes.set_ylim(cycle.valid.shape[1] - 0.5, -0.5)
    name_joints(axes, record.header.robot.joint_names)
    axes.set_ylabel("joint")
    axes.set_title("Changed commands and failed reads")
    legend_above(axes, 3)


def _marks(record: RunRecord, kind: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Times and joints of a kind of verdict; a verdict on no joint in particular is on all."""
    cycle = record.cycle
    all_joints = tuple(range(cycle.asked_rad.shape[1]))
    marks = [
        (t, joint)
        for t, verdict, joints in zip(cycle.time_s, cycle.verdict, cycle.joints, strict=True)
        if verdict == kind
        for joint in (joints or all_joints)
    ]
    return np.array([t for t, _ in marks]), np.array([j for _, j in marks], dtype=np.int64)
