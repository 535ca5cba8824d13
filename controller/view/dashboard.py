"""The panels next to the scene: state, a row of bars for each servo, curves over time, events."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
import viser
from viser import uplot

from snakewalk.config import colours
from snakewalk.config.arrays import Floats
from snakewalk.controller.metrics.ground_slope import carrier_share, ground_slope
from snakewalk.controller.metrics.path_error import ground_speed_m_s
from snakewalk.controller.metrics.verdict import RunVerdict
from snakewalk.controller.runlog.column import Curve, Panel
from snakewalk.controller.runlog.panels import CurveValues, panel_curves
from snakewalk.controller.runlog.record import POSE_CHECK, Event, Header, RunRecord
from snakewalk.controller.runlog.topics import TABLES
from snakewalk.controller.view.scene import contour_step_m

SPAN_S = 30.0
"""Time span of the past that the curves show (ours)."""
_POINTS = 150
"""Points of a curve: more would only be sent."""
_EVENTS = 7
_AMBIENT_C = 20.0
_LATE_CYCLES = 3.0
"""Readings that are this number of cycles old are shown in another colour (ours)."""
_SPEED = Curve(Panel.SPEED, "centre of mass, mean of 2 s", "blue")
_GOOD, _WARN, _BAD_COLOUR, _INK = colours.MEASURED, colours.WARNING, colours.FAULT, "#666"
_LEVELS = {"info": _INK, "warning": _WARN, "error": _BAD_COLOUR}


class Dashboard:
    """Panels of one run."""

    def __init__(
        self,
        server: viser.ViserServer,
        header: Header,
        switches: Mapping[str, viser.SceneNodeHandle],
    ) -> None:
        """Add the panels; ``switches`` are nodes of the scene that a checkbox hides."""
        self._robot = header.robot
        self._run = header.run
        safety = header.run.safety
        self._limit_a = safety.current_limit_of_a(header.robot)
        step_m = None if header.ground is None else contour_step_m(header.ground)
        self._contours = "" if step_m is None else f"<br>contours every {100.0 * step_m:g} cm"
        self._ground = header.ground
        self._limit_c = safety.temperature_limit_c
        self._volts = safety.voltage_limits_v(header.robot.servo)
        self._stale_s = safety.stale_limit_s
        self._speed_m_s = np.nan
        self._names = [
            header.robot.joint_label(k).removeprefix("joint ")
            for k in range(header.robot.joint_count)
        ]
        self._gui = gui = server.gui
        self._picture: viser.GuiHtmlHandle | None = None
        self._state = gui.add_html("")
        self._verdict = gui.add_html("")
        self.follow = gui.add_checkbox("follow the body", True)
        self.checks_pose = header.backend == POSE_CHECK
        self.goals = gui.add_checkbox(
            "show goals",
            not self.checks_pose,
            hint="amber, where joints should be",
            visible=not self.checks_pose,
        )
        with gui.add_folder("show", expand_by_default=False):
            for label, node in switches.items():
                gui.add_checkbox(label, True).on_update(_hiding(node))
        self.tabs = tabs = gui.add_tab_group()
        if self.checks_pose:
            with tabs.add_tab("pose"):
                self._feed = gui.add_html("")
        else:
            self._add_joints(gui, tabs)
        with tabs.add_tab("events"):
            self._events = gui.add_html("")

    def _add_joints(self, gui: viser.GuiApi, tabs: viser.GuiTabGroupHandle) -> None:
        with tabs.add_tab("servos"):
            self._bars = gui.add_html("")
        with tabs.add_tab("curves"):
            self.joint = gui.add_dropdown("joint", tuple(self._names))
            self._angle = _plot(
                gui, "angle, rad", {"goal": colours.GOAL, "measured": colours.MEASURED}
            )
            joints = _of_joints(self._names)
            self._current = _plot(gui, "current of all joints, A", joints, legend=False)
            self._apart = _plot(gui, "current less its shadow's, A", joints, legend=False)
            self._apart.visible = False
            self._panels = {
                panel: _plot(gui, panel, _curve_colours(panel))
                for panel in Panel
                if not panel.is_of_one_joint and panel != Panel.CURRENT  # above, of all joints
            }
            for joint_panel in self._panels.values():
                joint_panel.visible = False

    def show_picture(self, jpeg: str) -> None:
        """Show the image of the run's camera, in base64; the first image makes the tab."""
        if self._picture is None:
            with self.tabs.add_tab("camera"):
                self._picture = self._gui.add_html("")
        self._picture.content = (
            f"<img alt='camera' style='width:100%' src='data:image/jpeg;base64,{jpeg}'>"
        )

    def show_state(self, record: RunRecord, cycle: int, pose: int, text: str) -> None:
        """Show how the run is doing, in words."""
        where = record.pose
        time_s = float(record.cycle.time_s[cycle])
        waypoints = len(record.waypoints_at(time_s))
        reached = int(where.target[pose])
        facts = []
        if waypoints:
            facts.append(f"waypoint {min(reached + 1, waypoints)} of {waypoints}")
        if np.isfinite(self._speed_m_s):
            facts.append(f"{self._speed_m_s:.2f} m/s")
        if self._ground is not None:
            ahead_rad, steepest_rad = ground_slope(self._ground, where.links_m[pose][None])
            if np.isfinite(ahead_rad[0]) and not self.checks_pose:
                ahead, steepest = np.degrees([ahead_rad[0], steepest_rad[0]])
                facts.append(f"slope {steepest:.0f}°, {ahead:+z.0f}° ahead")
        if np.isfinite(share := carrier_share(record)):
            facts.append(f"{share:.0%} of the walk on wide waves")
        evidence = record.header.pose_evidence
        believes = "" if evidence.is_measured else "believed: "
        progress = f", {believes}{', '.join(facts)}" if facts else ""
        colour = _INK if evidence.is_measured else _BAD_COLOUR
        evidence_html = f"<span style='color:{colour}'>pose: {escape(evidence.text)}</span>"
        self._state.content = (
            f"<div style='padding:0 .8em .4em'><b>{escape(self._run.name)}</b> on "
            f"{escape(self._robot.name)}<br>{time_s:.1f} s"
            f"{progress}<br>{evidence_html}"
            f"{self._contours}<br>{escape(text)}</div>"
        )

    def show_verdict(self, verdict: RunVerdict) -> None:
        """Show how the run ended."""
        colour = _BAD_COLOUR if verdict.exit_code else _INK
        self._verdict.content = (
            f"<div style='padding:0 .8em .4em;color:{colour}'>{escape(verdict.text)}"
            f"<br>{escape(verdict.evidence)}</div>"
        )

    def show_servos(self, record: RunRecord, cycle: int, slow: int | None) -> None:
        """Show a row of bars for each servo; a check of a pose knows none."""
        if self.checks_pose:
            return
        rows = record.cycle
        period_s = 1.0 / self._run.cycle_hz
        heat, volts = np.full((2, self._robot.joint_count), np.nan)
        if slow is not None:
            heat = record.slow.temperature_c[slow]
            volts = record.slow.voltage_v[slow]
        lines = []
        for joint, name in enumerate(self._names):
            age_s = rows.age_s[cycle, joint]
            stale = age_s > self._stale_s
            old = _BAD_COLOUR if stale else _WARN if age_s > _LATE_CYCLES * period_s else _INK
            low, high = self._volts
            bad_v = not low <= volts[joint] <= high and np.isfinite(volts[joint])
            current_a = abs(rows.current_a[cycle, joint])
            cells = (
                escape(name),
                _angle_bar(
                    rows.measured_rad[cycle, joint],
                    rows.sent_rad[cycle, joint],
                    self._robot.limit_rad[joint],
                ),
                _bar(current_a / self._limit_a, f"{current_a:.2f}"),
                _bar(
                    (heat[joint] - _AMBIENT_C) / (self._limit_c - _AMBIENT_C), f"{heat[joint]:.0f}"
                ),
                f"<span style='color:{_BAD_COLOUR if bad_v else _INK}'>"
                f"{_number(volts[joint], 1)}</span>",
                f"<span style='color:{old}'>{_number(age_s * 1e3, 0)}</span>",
            )
            lines.append("<tr><td>" + "</td><td>".join(cells) + "</td></tr>")
        head = (
            "<tr><th>joint</th><th>angle, rad</th><th>A</th>"
            "<th>°C</th><th>V</th><th>age, ms</th></tr>"
        )
        self._bars.content = (
            "<table style='width:100%;font-size:11px;line-height:1.25;border-spacing:4px 1px;"
            f"white-space:nowrap;text-align:right'>{head}{''.join(lines)}</table>"
        )

    def show_curves(self, record: RunRecord, cycle: int) -> None:
        """Show the last seconds up to a row; a check of a pose has no curves."""
        if self.checks_pose:
            return
        last_s = float(record.cycle.time_s[cycle])
        record = record.between(last_s - SPAN_S, last_s)
        rows = record.cycle
        pick = _spread(len(rows.time_s))
        time_s = rows.time_s[pick]
        joint = self._names.index(self.joint.value)
        self._angle.data = (time_s, rows.sent_rad[pick, joint], rows.measured_rad[pick, joint])
        self._current.data = (time_s, *rows.current_a[pick].T)
        if len(record.shadow.time_s):
            self._apart.visible = True
            self._apart.data = (time_s, *_current_difference_a(record, pick).T)
        speed = CurveValues(_SPEED, record.pose.time_s, ground_speed_m_s(record.pose))
        self._speed_m_s = float(speed.values[-1])
        for panel, plot in self._panels.items():
            curves = panel_curves(record, panel)
            if panel is Panel.SPEED and np.isfinite(speed.values).any():
                curves.append(speed)
            if curves:
                plot.visible = True
                plot.data = (time_s, *_newest_values(panel, curves, time_s))

    def show_events(self, events: tuple[Event, ...]) -> None:
        """Show the newest events, the newest first; of a checked pose, its facts as well."""
        if self.checks_pose:
            self._feed.content = _feed_lines(events)
        self._events.content = "".join(
            "<div style='padding:.15em .8em;font-size:12px;"
            f"color:{_LEVELS.get(event.level, _INK)}'>"
            f"{event.time_s:.1f} s &nbsp;{escape(event.kind.replace('stop', 'end'))}: "
            f"{escape(event.text)}</div>"
            for event in reversed(events[-_EVENTS:])
        )


def _feed_lines(events: Sequence[Event]) -> str:
    """Return the newest facts of a checked pose, one a line, and the faults reported with them."""
    begins = [k for k, event in enumerate(events) if event.kind == "pose"]
    newest = events[begins[-1] :] if begins else ()
    lines = [
        (_LEVELS.get(shown_event.level, _INK), text)
        for shown_event in newest
        for text in (
            shown_event.text.split("; ") if shown_event.kind == "pose" else (shown_event.text,)
        )
    ]
    return "".join(
        f"<div style='padding:.15em .8em;color:{colour}'>{escape(text)}</div>"
        for colour, text in lines
    )


def _hiding(node: viser.SceneNodeHandle) -> Callable[[viser.GuiEvent[Any]], None]:
    """Callback of a checkbox that shows or hides a node."""

    def hide(event: viser.GuiEvent[Any]) -> None:
        node.visible = event.target.value

    return hide


def _plot(
    gui: viser.GuiApi, title: str, names: Mapping[str, str], *, legend: bool = True
) -> viser.GuiUplotHandle:
    """Add a plot of curves, names with their colours."""
    series = [uplot.Series(label=name, stroke=colour, width=1.5) for name, colour in names.items()]
    return gui.add_uplot(
        tuple(np.zeros(2) for _ in range(len(names) + 1)),
        (uplot.Series(label="s"), *series),
        title=title,
        scales={"x": uplot.Scale(time=False, auto=True)},
        legend=uplot.Legend(show=legend and len(names) > 1),
        axes=(uplot.Axis(), uplot.Axis(space=18)),
        aspect=2.2,
    )


def _current_difference_a(record: RunRecord, rows: np.ndarray) -> Floats:
    """Currents (n, J) of some cycles less those of the shadow; NaN where it has no row."""
    time_s = record.cycle.time_s[rows]
    shadow = record.shadow
    shadow_index = np.minimum(np.searchsorted(shadow.time_s, time_s), len(shadow.time_s) - 1)
    is_current = (shadow.time_s[shadow_index] == time_s)[:, np.newaxis]
    return np.where(
        is_current, record.cycle.current_a[rows] - shadow.current_a[shadow_index], np.nan
    )


def _spread(rows: int) -> np.ndarray:
    points = max(min(rows, _POINTS), 2)
    return np.unique(np.linspace(0, rows - 1, points).astype(int))


def _of_joints(names: Sequence[str]) -> dict[str, str]:
    """Colours of all joints, from dark at the head to light at the tail."""
    share = np.linspace(0.0, 0.75, len(names))[:, None]
    dark = np.array(colours.rgb(colours.MEASURED))
    tones = np.rint(dark + share * (255 - dark)).astype(int).tolist()
    return {
        name: f"#{red:02x}{green:02x}{blue:02x}"
        for name, (red, green, blue) in zip(names, tones, strict=True)
    }


def _curve_colours(panel: Panel) -> dict[str, str]:
    """Names of all curves of a panel with their colours, which the report shares."""
    curves = [
        curve
        for table in TABLES
        for column in table.topic.columns.values()
        for curve in column.curves
        if curve.panel == panel
    ]
    curves += [_SPEED] if panel is Panel.SPEED else []
    return {curve.name: colours.COLOURS[curve.colour] for curve in curves}


def _newest_values(panel: Panel, curves: Sequence[CurveValues], time_s: Floats) -> list[Floats]:
    """Values (n,) of each curve of a panel that were the newest at some times."""
    newest_values = {
        curve.curve.name: curve.values[
            np.maximum(np.searchsorted(curve.time_s, time_s, side="right") - 1, 0)
        ]
        for curve in curves
    }
    unknown = np.full(len(time_s), np.nan)
    return [newest_values.get(name, unknown) for name in _curve_colours(panel)]


def _bar(share: float, text: str) -> str:
    """A bar from the left; red where it nears its limit."""
    is_known = np.isfinite(share)
    width = 100.0 * min(max(share, 0.0), 1.0) if is_known else 0.0
    color = _BAD_COLOUR if width > 85.0 else _WARN if width > 60.0 else _GOOD
    return _box(
        f"<div style='width:{width:.0f}%;height:100%;background:{color};opacity:.55'></div>",
        text if is_known else "",
    )


def _angle_bar(measured_rad: float, goal_rad: float, limit_rad: float) -> str:
    """A bar from the middle to where the joint is, and a stroke where it should be."""
    position_share, goal = (
        50.0 + 50.0 * min(max(value / limit_rad, -1.0), 1.0) if np.isfinite(value) else 50.0
        for value in (measured_rad, goal_rad)
    )
    left = min(position_share, 50.0)
    width = abs(position_share - 50.0)
    return _box(
        f"<div style='position:absolute;left:{left:.1f}%;width:{width:.1f}%;height:100%;"
        f"background:{_GOOD};opacity:.55'></div><div style='position:absolute;left:{goal:.1f}%;"
        f"width:2px;height:100%;background:{_WARN}'></div>",
        _number(measured_rad, 2),
        wide=True,
    )


def _box(inside: str, text: str, *, wide: bool = False) -> str:
    return (
        f"<div style='position:relative;min-width:{8 if wide else 4}em;height:1.25em;"
        "background:rgba(128,128,128,.15);border-radius:2px;overflow:hidden'>"
        f"{inside}<span style='position:absolute;right:3px;top:0'>{text}</span></div>"
    )


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"
