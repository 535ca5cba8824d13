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
from snakewalk.config.colours import AMBER, BLUE, COLOURS, GREEN, INK, RED, rgb
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
_PANEL_PX = 160
_GAP_PX = 34
"""Gap between two panels for the title and the legend of the lower one."""
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
    """Traces, layout, and values of every joint's two panels for Plotly; joint ``shown`` first."""
    step = _step(len(record.cycle.time_s))
    joint = [(panel, panel_curves(record, panel, step)) for panel in Panel if panel.is_of_one_joint]
    traces = [
        trace
        for row, (_, curves) in enumerate(panels, start=1)
        for name, colour, time_s, values in curves
        for trace in _traces(name, colour, row, time_s, values)
    ]
    first = len(traces)
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
    titles = [_title(record, title) for title, _ in (*panels, *joint)]
    return {
        "traces": traces,
        "layout": _layout(record, titles),
        "joints": every,
        "first": first,
        "height": _PANEL_PX * len(titles) + 88,
    }


def _title(record: RunRecord, title: str) -> str:
    """Return the title of a panel; without a measured pose it states dead reckoning."""
    is_of_the_pose = title in (_DISTANCE, Panel.SPEED)
    return title + ", dead-reckoned" * (
        is_of_the_pose and not record.header.pose_evidence.is_measured
    )


def _layout(record: RunRecord, titles: Sequence[str]) -> dict[str, Any]:
    count = len(titles)
    reached = "solid" if record.header.pose_evidence.is_measured else "dash"
    gap = _GAP_PX / (_PANEL_PX * count)
    tall = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {
        "margin": {"l": 46, "r": 8, "t": 50, "b": 36},
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": INK},
        "hovermode": "x",
        "showlegend": True,
        "dragmode": "zoom",
        "xaxis": {
            "range": [0.0, max(record.end_s, 1e-3)],
            "title": {"text": "time (s)", "standoff": 4},
            "anchor": "free",
            "position": 0.0,
        },
        "annotations": [],
        "shapes": [
            _line(time_s, colour, dash)
            for colour, dash, times in (
                (GREEN, reached, list(waypoint_times_s(record.pose, record.header.plan))),
                (AMBER, "solid", [e.time_s for e in record.events if e.level == "warning"][:100]),
                (RED, "solid", [e.time_s for e in record.events if e.level == "error"][:100]),
            )
            for time_s in times
        ],
    }
    for row, title in enumerate(titles, start=1):
        top = 1.0 - (row - 1) * (tall + gap)
        layout["yaxis" if row == 1 else f"yaxis{row}"] = {
            "domain": [max(top - tall, 0.0), top],
            "fixedrange": True,
            "gridcolor": "#e9edf1",
            "zerolinecolor": "#d9e0e6",
            "nticks": 5,
        }
        layout["legend" if row == 1 else f"legend{row}"] = {
            "orientation": "h",
            "x": 1.0,
            "xanchor": "right",
            "y": top,
            "yanchor": "bottom",
        }
        layout["annotations"].append(
            {
                "text": f"<b>{title}</b>",
                "xref": "paper",
                "yref": "paper",
                "x": 0.0,
                "y": top,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
            }
        )
    return layout


def _line(time_s: float, colour: str, dash: str) -> dict[str, Any]:
    return {
        "type": "line",
        "x0": time_s,
        "x1": time_s,
        "yref": "paper",
        "y0": 0.0,
        "y1": 1.0,
        "line": {"color": colour, "width": 1, "dash": dash},
        "opacity": 0.6,
        "layer": "below",
    }


def _traces(
    name: str, colour: str, row: int, time_s: Floats, values: Floats
) -> list[dict[str, Any]]:
    finite_values = values[np.isfinite(values)]
    if len(finite_values) < _BLOCK or _crossings(finite_values) < _BLOCK:
        return [_trace(name, colour, row, time_s, values)]
    at_s, low, mean, high = thin(time_s, values, _BAND_POINTS)
    edge = {"line": {"color": _pale(colour), "width": 1}, "showlegend": False}
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
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": _packed_values(time_s),
        "y": _packed_values(values),
        "xaxis": "x",
        "yaxis": "y" if row == 1 else f"y{row}",
        "legend": "legend" if row == 1 else f"legend{row}",
        "line": {"color": colour, "width": 1.3},
        "hovertemplate": f"{name} %{{y:.4g}}<extra></extra>",
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
