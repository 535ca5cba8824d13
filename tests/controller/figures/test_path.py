"""The map of a run: which path is drawn how, its proportions, and what is measured."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from snakewalk.config.colours import GREY, PATH, REACHED
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.figures.path import draw_ground, path_figure
from snakewalk.controller.figures.style import WIDTH_IN
from snakewalk.controller.runlog.record import RunRecord

LINE = np.array([[0.0, 0.0], [1.0, 0.5]])


def axes_of(record: RunRecord) -> Axes:
    figure = path_figure(record)
    assert figure is not None
    return figure.axes[0]


def test_the_plan_is_strong_and_paths_that_were_laid_again_are_pale(record: RunRecord) -> None:
    paths = ((0.0, LINE), (3.0, LINE + 0.1), (5.0, LINE + 0.2))
    drawn = axes_of(replace(record, paths=paths)).lines
    lines = [line for line in drawn if any(np.array_equal(line.get_xydata(), p) for _, p in paths)]
    assert [line.get_color() for line in lines] == [PATH, GREY, GREY]
    named = [str(line.get_label()) for line in lines]
    assert named[:2] == ["planned path", "laid again"]
    assert named[2].startswith("_"), "once in the legend"
    assert lines[0].get_linewidth() > lines[1].get_linewidth()
    assert not any(line.get_linestyle() == "-" for line in lines)


@pytest.mark.parametrize(
    ("tall_m", "height_in"), [(0.0, 3.2), (10.0, 0.86 * WIDTH_IN), (80.0, 7.2)]
)
def test_the_figure_is_as_tall_as_the_ground_within_its_limits(
    record: RunRecord, tall_m: float, height_in: float
) -> None:
    plan = replace(
        record.header.plan,
        path_m=np.array([[0.0, 0.0, 0.0], [10.0, tall_m, 0.0]]),
        waypoints_m=np.zeros((0, 2)),
    )
    still = np.zeros_like(record.pose.head_m)
    pose = replace(
        record.pose, head_m=still, centre_m=still, links_m=np.full_like(record.pose.links_m, np.nan)
    )
    figure = path_figure(replace(record, header=replace(record.header, plan=plan), pose=pose))
    assert figure is not None
    assert figure.get_figheight() == pytest.approx(min(max(height_in, 3.2), 7.2))


def test_a_waypoint_is_a_disc_below_its_path_in_the_colour_of_its_arrival(
    record: RunRecord,
) -> None:
    axes = axes_of(record)
    circles = [patch for patch in axes.patches if isinstance(patch, Circle)]
    assert len(circles) == len(record.header.plan.waypoints_m)
    path = next(line for line in axes.lines if line.get_label() == "planned path")
    for circle, point in zip(circles, record.header.plan.waypoints_m, strict=True):
        assert circle.center == pytest.approx(tuple(point[:2]))
        assert circle.radius == record.header.plan.waypoint_radius_m
        assert 0.0 < circle.get_zorder() < path.get_zorder()
    reached = to_rgba(REACHED)[:3]
    assert circles[0].get_edgecolor()[:3] == pytest.approx(reached)


def test_the_ground_is_behind_everything_and_has_a_scale() -> None:
    figure = Figure()
    axes = figure.subplots()
    ground = HeightField(np.outer(np.linspace(0.0, 0.4, 9), np.ones(9)), 0.25, -1.0, -1.0)
    draw_ground(axes, ground)
    (image,) = axes.images
    assert image.get_zorder() == 0.0
    assert image.get_extent() == pytest.approx([-1.0, 1.0, -1.0, 1.0])
    assert figure.axes[1].get_ylabel() == "height of the ground (m)"
    shaded = np.asarray(image.get_array())
    assert shaded[-1].mean() > shaded[0].mean(), "lighter the higher"
