"""Curves of a run that can be zoomed and read off: Plotly's own page element, in the report."""

import base64
import gzip
import json
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.figures.style import (
    AMBER,
    BLUE,
    FLAT_V,
    GREEN,
    GREY,
    INK,
    PURPLE,
    RED,
    SKY,
)
from snakewalk.controller.metrics.path_error import path_error_m, waypoint_times_s
from snakewalk.controller.runlog.record import RunRecord

_ROWS: Final = 4000
"""Most rows of a curve: of a longer run every second, third ... row is on the page (ours)."""
_PANEL_PX: Final = 150
_GAP: Final = 0.055
_FLAT_C: Final = 1.0
"""Span up to which temperature holds no information (ours)."""
Curve = tuple[str, str, Floats, Floats]
"""Name, colour, times, values."""


def curves_html(record: RunRecord) -> str:
    """HTML of the section, the library in it; empty where the log has nothing to draw."""
    if len(record.cycle.time_s) < 2:
        return ""
    panels, constant = _panels(record)
    spec = json.dumps(_figure(record, panels))
    joints = "".join(
        f"<option value='{k}'>joint {k + 1}</option>"
        for k in range(record.cycle.asked_rad.shape[1])
    )
    step = _step(len(record.cycle.time_s))
    which = "" if step == 1 else f" Every {step}. cycle is here, all are in the log."
    return (
        "<section id='curves'><h2>Curves</h2><figure>"
        f"<p class='facts'><label>Last two panels: <select id='joint'>{joints}</select></label></p>"
        "<div id='plot'><noscript>Curves need scripts; the pictures below do not.</noscript></div>"
        "<figcaption>Drag to zoom in time, double-click for all, click a name to hide its curve. "
        "Green: a waypoint reached; amber and orange: a warning, an error. The dark line is the "
        f"film's time.{which}{constant}</figcaption></figure>"
        f"<script id='plotly' type='text/plain'>{_library()}</script>"
        f"<script id='curves-data' type='text/plain'>{_zipped(spec)}</script></section>"
    )


def _panels(record: RunRecord) -> tuple[list[tuple[str, list[Curve]]], str]:
    """Panels (title with unit, curves) that hold information, and in words what is constant."""
    pose, cycle, slow = record.pose, record.cycle, record.slow
    size_a = np.where(np.isfinite(cycle.current_a), np.abs(cycle.current_a), np.nan)
    known = np.isfinite(size_a).any(axis=1)
    high_a, mean_a = np.full(len(size_a), np.nan), np.full(len(size_a), np.nan)
    high_a[known], mean_a[known] = (
        np.nanmax(size_a[known], axis=1),
        np.nanmean(size_a[known], axis=1),
    )
    panels = [
        ("from the path, m", [("from the path", BLUE, pose.time_s, path_error_m(record))]),
        (
            "forward speed, m/s",
            [
                ("pulse", GREY, pose.time_s, pose.pulse_m_s),
                ("predicted", AMBER, pose.time_s, pose.predicted_speed_m_s),
                ("speed", BLUE, pose.time_s, pose.speed_m_s),
            ],
        ),
        (
            "current, A",
            [
                ("highest joint", RED, cycle.time_s, high_a),
                ("mean of joints", SKY, cycle.time_s, mean_a),
            ],
        ),
        (
            "in a cycle, ms",
            [
                ("on the wire", BLUE, cycle.deadline_s, 1e3 * cycle.wire_busy_s),
                ("began late", AMBER, cycle.deadline_s, 1e3 * cycle.lateness_s),
            ],
        ),
    ]
    constant = []
    for title, values, colour, flat, unit in (
        ("hottest servo, °C", _extreme(slow.temperature_c, np.nanmax), RED, _FLAT_C, "°C"),
        ("lowest supply, V", _extreme(slow.voltage_v, np.nanmin), AMBER, FLAT_V, "V"),
    ):
        name = title.partition(",")[0]
        if len(values) and np.isfinite(values).any():
            if np.nanmax(values) - np.nanmin(values) > flat:
                panels.append((title, [(name, colour, slow.time_s, values)]))
            else:
                constant.append(f"{name} {np.nanmedian(values):.1f} {unit}")
    if not cycle.lateness_s.any():
        panels[3][1].pop()
        constant.append("no cycle began late")
    panels = [
        (title, [curve for curve in curves if np.isfinite(curve[3]).any()])
        for title, curves in panels
    ]
    words = f" Constant, and not drawn: {', '.join(constant)}." if constant else ""
    return [panel for panel in panels if panel[1]], words


def _extreme(values: Floats, reduce: Any) -> Floats:
    """(S,) of (S, J); NaN where no joint has a value."""
    known = np.isfinite(values).any(axis=1)
    found = np.full(len(values), np.nan)
    found[known] = reduce(values[known], axis=1)
    return found


def _figure(record: RunRecord, panels: Sequence[tuple[str, list[Curve]]]) -> dict[str, Any]:
    """Traces, layout, and of every joint what its two panels show, as Plotly takes them."""
    cycle = record.cycle
    joint: list[tuple[str, list[tuple[str, str, Floats]]]] = [
        (
            "joint's angle, rad",
            [
                ("asked", GREY, cycle.asked_rad),
                ("sent", AMBER, cycle.sent_rad),
                ("measured", BLUE, np.where(cycle.valid, cycle.measured_rad, np.nan)),
            ],
        ),
        ("joint's current, A", [("current", PURPLE, cycle.current_a)]),
    ]
    traces = [
        _trace(name, colour, row, time_s, values)
        for row, (_, curves) in enumerate(panels, start=1)
        for name, colour, time_s, values in curves
    ]
    first = len(traces)
    traces += [
        _trace(name, colour, row, cycle.time_s, values[:, 0])
        for row, (_, curves) in enumerate(joint, start=len(panels) + 1)
        for name, colour, values in curves
    ]
    every = [
        [_packed(values[:, k]) for _, curves in joint for *_, values in curves]
        for k in range(cycle.asked_rad.shape[1])
    ]
    titles = [title for title, _ in (*panels, *joint)]
    return {
        "traces": traces,
        "layout": _layout(record, titles),
        "joints": every,
        "first": first,
        "height": _PANEL_PX * len(titles) + 60,
    }


def _layout(record: RunRecord, titles: Sequence[str]) -> dict[str, Any]:
    count = len(titles)
    tall = (1.0 - _GAP * (count - 1)) / count
    layout: dict[str, Any] = {
        "margin": {"l": 46, "r": 8, "t": 22, "b": 36},
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": INK},
        "hovermode": "x",
        "showlegend": True,
        "legend": {"orientation": "h", "y": -40.0 / (_PANEL_PX * count), "yanchor": "top"},
        "dragmode": "zoom",
        "xaxis": {
            "range": [0.0, max(record.end_s, 1e-3)],
            "title": {"text": "time (s)", "standoff": 4},
            "anchor": "free",
            "position": 0.0,
        },
        "annotations": [],
        "shapes": [
            _line(time_s, colour)
            for colour, times in (
                (GREEN, list(waypoint_times_s(record.pose, record.header.plan))),
                (AMBER, [e.time_s for e in record.events if e.level == "warning"][:100]),
                (RED, [e.time_s for e in record.events if e.level == "error"][:100]),
            )
            for time_s in times
        ],
    }
    for row, title in enumerate(titles, start=1):
        top = 1.0 - (row - 1) * (tall + _GAP)
        layout["yaxis" if row == 1 else f"yaxis{row}"] = {
            "domain": [max(top - tall, 0.0), top],
            "fixedrange": True,
            "gridcolor": "#e9edf1",
            "zerolinecolor": "#d9e0e6",
            "nticks": 5,
        }
        layout["annotations"].append(
            {
                "text": f"<b>{title}</b>", "xref": "paper", "yref": "paper", "x": 0.0, "y": top,
                "xanchor": "left", "yanchor": "bottom", "showarrow": False,
            }
        )  # fmt: skip
    return layout


def _line(time_s: float, colour: str) -> dict[str, Any]:
    return {
        "type": "line", "x0": time_s, "x1": time_s, "yref": "paper", "y0": 0.0, "y1": 1.0,
        "line": {"color": colour, "width": 1}, "opacity": 0.6, "layer": "below",
    }  # fmt: skip


def _trace(name: str, colour: str, row: int, time_s: Floats, values: Floats) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": _packed(time_s),
        "y": _packed(values),
        "xaxis": "x",
        "yaxis": "y" if row == 1 else f"y{row}",
        "line": {"color": colour, "width": 1.3},
        "hovertemplate": f"{name} %{{y:.4g}}<extra></extra>",
    }


@cache
def _library() -> str:
    """Plotly, compressed once however many pages a process makes."""
    from plotly.offline import get_plotlyjs  # noqa: PLC0415  an extra

    return _zipped(get_plotlyjs())


def _zipped(text: str) -> str:
    """Base64, which holds no markup, of the compressed text; the page's script unpacks it."""
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def _step(rows: int) -> int:
    return max(1, -(-rows // _ROWS))


def _packed(values: Floats) -> dict[str, str]:
    """An array as Plotly's base64 of 4-byte numbers; NaN is a gap."""
    thinned = np.asarray(values[:: _step(len(values))], dtype="<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(thinned.tobytes()).decode()}
