"""Interventions of the safety layer over time: clamps, vetoes and unanswered reads by joint."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.colours import FAULT, GREY, WARNING
from snakewalk.controller.figures.style import canvas, label_time, legend_above, name_joints
from snakewalk.controller.runlog.record import RunRecord


def safety_figure(record: RunRecord) -> Figure | None:
    """Raster of joints over time; None if no command was changed and every read was answered."""
    cycle = record.cycle
    if cycle.valid.all() and set(cycle.verdict) <= {"pass"}:
        return None
    height = float(np.clip(0.09 * cycle.valid.shape[1], 1.4, 2.8))
    figure, (axes,) = canvas(1, height + 1.0)
    _raster(axes, record)
    label_time(axes, record.end_s)
    return figure


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


def _marks(record: RunRecord, kind: str) -> tuple[Floats, Ints]:
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
