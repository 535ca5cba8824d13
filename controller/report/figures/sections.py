"""The figures of the page, in order, each with a caption that says how to read it."""

from collections.abc import Callable

from matplotlib.figure import Figure

from snakewalk.controller.figures.path import path_figure
from snakewalk.controller.figures.style import data_uri, style
from snakewalk.controller.report.curves import curves_html
from snakewalk.controller.report.figures.attitude import attitude_figure
from snakewalk.controller.report.figures.joints import joints_figure
from snakewalk.controller.report.figures.safety import safety_figure
from snakewalk.controller.report.figures.slope import slope_figure
from snakewalk.controller.report.figures.walk import walk_figure
from snakewalk.controller.report.page import Section
from snakewalk.controller.runlog.record import RunRecord

_SECTIONS: tuple[tuple[str, str, Callable[[RunRecord], Figure | None]], ...] = (
    (
        "The way",
        "Seen from above. A waypoint's disc is its radius: green when the centre of mass has come "
        "inside it in its turn, orange when not. The body grows darker with time.",
        path_figure,
    ),
    (
        "Joint angles",
        "The shape travels from the head (top) to the tail (bottom). The remaining difference "
        "between goal and measured angle is servo lag, a clamp, or ground that does not give "
        "way.",
        joints_figure,
    ),
    (
        "Attitude",
        "The link of the robot's IMU. Roll and pitch come from gravity; the heading begins "
        "anywhere and drifts with the gyro's bias.",
        attitude_figure,
    ),
    (
        "The walk",
        "Each decision appends a part of the next state to the angles along the way.",
        walk_figure,
    ),
    (
        "Slope under the body",
        "Mean over the links, from the heights of the plan. On steep ground the walk rides on wide "
        "waves, which slip less.",
        slope_figure,
    ),
    (
        "Safety",
        "Every command goes through the limits below the controller: a clamp changes it, a veto "
        "stops the run.",
        safety_figure,
    ),
)


def drawn(record: RunRecord) -> tuple[list[Section], str]:
    """Return the sections of a page, and its curves as HTML."""
    return sections(record), curves_html(record)


def sections(record: RunRecord) -> list[Section]:
    """Draw the figures for which the log has data."""
    with style():
        drawn = [(title, caption, draw(record)) for title, caption, draw in _SECTIONS]
        return [
            Section(title, caption, data_uri(figure))
            for title, caption, figure in drawn
            if figure is not None
        ]
