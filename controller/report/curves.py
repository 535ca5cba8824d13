"""Curves of a run that can be zoomed and read off: Plotly's own page element, in the report."""

import base64
import gzip
import json
from collections.abc import Sequence
from functools import cache
from html import escape
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import AMBER, BLUE, COLOURS, GREEN, RED, rgb
from snakewalk.controller.figures.style import thin
from snakewalk.controller.metrics.path_error import ground_speed_m_s, path_error_m, waypoint_times_s
from snakewalk.controller.report.trip import trip_of
from snakewalk.controller.runlog.column import Panel
from snakewalk.controller.runlog.panels import panel_curves
from snakewalk.controller.runlog.record import RunRecord

_ROWS = 4000
"""Most rows of a curve: of a longer run every second, third ... row is on the page (ours)."""
_BLOCK = 400
"""Crossings of the middle of a curve from which a panel would show a block (ours): about one for
two pixels."""
_BAND_POINTS = 100
"""Places of the band that is drawn instead."""
_MOST_MARKS = 100
"""Warnings, and errors, that the curves mark (ours)."""
Curve = tuple[str, str, Floats, Floats]
"""Name, colour, times, values."""


def curves_html(record: RunRecord) -> str:
    """HTML of the section with its library; empty if the log has nothing to draw.

    The panels of one joint begin with the tripped joint, or with the first one.
    """
    if len(record.cycle.time_s) < 2:
        return ""
    panels, constant = _panels(record)
    trip = trip_of(record)
    shown = 0 if trip is None or trip.joint is None else trip.joint
    figure = _figure(record, panels, shown) | {"mark_s": 0.0 if trip is None else trip.time_s}
    spec = json.dumps(figure)
    joints = "".join(
        f"<option value='{k}'{' selected' if k == shown else ''}>"
        f"{escape(record.header.robot.joint_label(k))}</option>"
        for k in range(record.cycle.asked_rad.shape[1])
    )
    step = _step(len(record.cycle.time_s))
    passed = "a waypoint reached"
    if not record.header.pose_evidence.is_measured:
        passed = "the run believes it reached a waypoint"
    which = "" if step == 1 else f" One of {step} cycles is drawn; all are in the log."
    return (
        "<section id='curves'><h2>Curves</h2><figure>"
        f"<p class='facts'><label>Last two panels: <select id='joint'>{joints}</select></label></p>"
        "<div id='plot'><noscript>Curves need scripts. The pictures below do not.</noscript></div>"
        "<figcaption>Drag to zoom in time, double-click for all, click a name to hide its curve. "
        "Where a mean is drawn, pale lines show the least and the largest value. "
        f"Green: {passed}; amber and orange: a warning, an error. The dark line is "
        f"the time of the film or trip.{which}{constant}"
        "</figcaption></figure>"
        f"<script id='plotly' type='text/plain'>{_library()}</script>"
        f"<script id='curves-data' type='text/plain'>{_zipped_text(spec)}</script></section>"
    )


_DISTANCE = "distance from the path, m"


def _panels(record: RunRecord) -> tuple[list[tuple[str, list[Curve]]], str]:
    """Panels (title with unit, curves), and a sentence about the constant values."""
    error_m = path_error_m(record)
    panels: list[tuple[str, list[Curve]]] = []
    if np.isfinite(error_m).any():
        panels.append((_DISTANCE, [("from the path", BLUE, record.pose.time_s, error_m)]))
    constant = []
    speed_m_s = ground_speed_m_s(record.pose)
    for panel in Panel:
        curves = [] if panel.is_of_one_joint else panel_curves(record, panel)
        constant += [curve.constant_text for curve in curves if curve.is_constant]
        drawn = [
            (curve.curve.name, COLOURS[curve.curve.colour], curve.time_s, curve.values)
            for curve in curves
            if not curve.is_constant
        ]
        if panel is Panel.SPEED and np.isfinite(speed_m_s).any():
            drawn.insert(0, ("centre of mass, mean of 2 s", BLUE, record.pose.time_s, speed_m_s))
        if drawn:
            panels.append((panel, drawn))
    words = f" Constant, and not drawn: {', '.join(constant)}." if constant else ""
    return panels, words


def _figure(
    record: RunRecord, panels: Sequence[tuple[str, list[Curve]]], shown: int
) -> dict[str, Any]:
    """Traces, titles, marks and values of every joint's two panels for the page's script.

    Joint ``shown`` comes first.
    """
    step = _step(len(record.cycle.time_s))
    joint = [(panel, panel_curves(record, panel, step)) for panel in Panel if panel.is_of_one_joint]
    traces = [
        trace
        for row, (_, curves) in enumerate(panels, start=1)
        for name, colour, time_s, values in curves
        for trace in _traces(name, colour, row, time_s, values)
    ]
    traces += [
        _trace(
            curve.curve.name, COLOURS[curve.curve.colour], row, curve.time_s, curve.values[:, shown]
        )
        for row, (_, curves) in enumerate(joint, start=len(panels) + 1)
        for curve in curves
    ]
    every = [
        [_packed_values(curve.values[:, k]) for _, curves in joint for curve in curves]
        for k in range(record.cycle.asked_rad.shape[1])
    ]
    return {
        "traces": traces,
        "titles": [_title(record, title) for title, _ in (*panels, *joint)],
        "marks": _marks(record),
        "end_s": record.end_s,
        "joints": every,
    }


def _title(record: RunRecord, title: str) -> str:
    """Return the title of a panel; without a measured pose it states dead reckoning."""
    is_of_the_pose = title in (_DISTANCE, Panel.SPEED)
    return title + ", dead-reckoned" * (
        is_of_the_pose and not record.header.pose_evidence.is_measured
    )


def _marks(record: RunRecord) -> list[tuple[float, str, str]]:
    """Times with colour and dash: reached waypoints, and the first warnings and errors."""
    reached = "solid" if record.header.pose_evidence.is_measured else "dash"
    marks = [
        (float(time_s), GREEN, reached)
        for time_s in waypoint_times_s(record.pose, record.header.plan)
    ]
    for level, colour in (("warning", AMBER), ("error", RED)):
        times = [event.time_s for event in record.events if event.level == level]
        marks += [(time_s, colour, "solid") for time_s in times[:_MOST_MARKS]]
    return marks


def _traces(
    name: str, colour: str, row: int, time_s: Floats, values: Floats
) -> list[dict[str, Any]]:
    finite_values = values[np.isfinite(values)]
    if len(finite_values) < _BLOCK or _crossings(finite_values) < _BLOCK:
        return [_trace(name, colour, row, time_s, values)]
    at_s, low, mean, high = thin(time_s, values, _BAND_POINTS)
    edge = {"colour": _pale(colour), "showlegend": False}
    return [
        _trace(f"{name}, least", colour, row, at_s, low) | edge,
        _trace(f"{name}, largest", colour, row, at_s, high) | edge,
        _trace(f"{name}, mean", colour, row, at_s, mean),
    ]


def _crossings(values: Floats) -> int:
    """Return how often a curve crosses the middle between its least and its largest value."""
    above = values > (values.min() + values.max()) / 2
    return int(np.count_nonzero(above[1:] != above[:-1]))


def _pale(colour: str) -> str:
    return f"rgba({', '.join(str(part) for part in rgb(colour))}, 0.5)"


def _trace(name: str, colour: str, row: int, time_s: Floats, values: Floats) -> dict[str, Any]:
    return {
        "name": name,
        "x": _packed_values(time_s),
        "y": _packed_values(values),
        "colour": colour,
        "row": row,
    }


@cache
def _library() -> str:
    """Plotly, compressed once however many pages a process makes."""
    return _zipped_text(get_plotlyjs())


def _zipped_text(text: str) -> str:
    """Base64, which holds no markup, of the compressed text; the page's script unpacks it."""
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def _step(rows: int) -> int:
    return max(1, -(-rows // _ROWS))


def _packed_values(values: Floats) -> dict[str, str]:
    """An array as Plotly's base64 of 4-byte numbers; NaN is a gap."""
    thinned = np.asarray(values[:: _step(len(values))], dtype="<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(thinned.tobytes()).decode()}
