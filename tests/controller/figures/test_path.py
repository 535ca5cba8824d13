"""The map of a run: which path is drawn how, its proportions, and what is measured."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from snakewalk.config.colours import GREY, PATH, REACHED
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import Obstacle, PoleObstacle
from snakewalk.controller.figures.path import body_outline_m, draw_ground, path_figure
from snakewalk.controller.figures.style import WIDTH_IN
from snakewalk.controller.runlog.record import RunRecord

LINE = np.array([[0.0, 0.0, 0.1], [1.0, 0.5, 0.2]])


def axes_of(record: RunRecord) -> Axes:
    figure = path_figure(record)
    assert figure is not None
    return figure.axes[0]


def test_the_plan_is_strong_and_paths_that_were_laid_again_are_pale(record: RunRecord) -> None:
    paths = ((0.0, LINE), (3.0, LINE + 0.1), (5.0, LINE + 0.2))
    drawn = axes_of(replace(record, paths=paths)).lines
    lines = [
        line for line in drawn if any(np.array_equal(line.get_xydata(), p[:, :2]) for _, p in paths)
    ]
    assert len(drawn) == len(lines) + 3, "beside the tracks of head and centre, and the cursor's"
    assert [line.get_color() for line in lines] == [PATH, GREY, GREY]
    named = [str(line.get_label()) for line in lines]
    assert named[:2] == ["planned path", "laid again"]
    assert named[2].startswith("_"), "once in the legend"
    assert lines[0].get_linewidth() > lines[1].get_linewidth()
    assert not any(line.get_linestyle() == "-" for line in lines)


@pytest.mark.parametrize(
    ("obstacle", "is_drawn"),
    [
        (PoleObstacle(radius_m=0.05, at_m=(1.0, 0.2)), True),
        (PoleObstacle(radius_m=0.05, at_m=(90.0, 0.2)), False),
        (PoleObstacle(radius_m=0.05, upright=False), False),
    ],
)
def test_what_stands_on_the_ground_is_in_the_map(
    record: RunRecord, obstacle: Obstacle, is_drawn: bool
) -> None:
    world = record.header.world.model_copy(update={"obstacle": obstacle})
    axes = axes_of(replace(record, header=replace(record.header, world=world)))
    names = [str(line.get_label()) for line in axes.lines]
    assert (obstacle.kind in names) == is_drawn


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
    numbers = {text.get_text(): text for text in axes.texts}
    for number, point in enumerate(record.header.plan.waypoints_m, start=1):
        assert numbers[str(number)].xy == pytest.approx(tuple(point[:2]))
        assert numbers[str(number)].get_zorder() > path.get_zorder()


def crawling(record: RunRecord, lengths: float) -> RunRecord:
    """A straight body that goes so many of its lengths to the left; one pose is not known."""
    plan = replace(record.header.plan, waypoints_m=np.zeros((0, 2)), path_m=np.zeros((0, 3)))
    robot = record.header.robot
    count = 101
    x = np.linspace(0.0, lengths * robot.length_m, count)
    along_m = np.cumsum(robot.link_lengths_m) - 0.5 * np.asarray(robot.link_lengths_m)
    links = np.zeros((count, len(along_m), 3))
    links[..., 0] = along_m - x[:, None]
    centre = links.mean(axis=1)
    links[50] = np.nan
    pose = replace(
        record.pose,
        **{
            name: np.resize(
                getattr(record.pose, name), (count, *getattr(record.pose, name).shape[1:])
            )
            for name in ("time_s", "target")
        },
        links_m=links,
        centre_m=centre,
        head_m=centre,
    )
    return replace(record, header=replace(record.header, plan=plan), pose=pose)


@pytest.mark.parametrize(("lengths", "bodies"), [(0.0, 2), (1.2, 2), (2.7, 3), (13.1, 11)])
def test_bodies_are_drawn_one_and_a_third_of_a_length_apart_and_darker_later(
    record: RunRecord, lengths: float, bodies: int
) -> None:
    axes = axes_of(crawling(record, lengths))
    drawn = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    assert len(drawn) == bodies
    assert drawn[-1].get_label() == f"body, {bodies} times"
    strengths = [patch.get_alpha() for patch in drawn]
    assert strengths == pytest.approx(np.linspace(0.25, 0.85, bodies).tolist())
    heads = [patch.get_xy()[:, 0].min() for patch in drawn]
    radius_m = record.header.robot.body_radius_m
    assert heads[0] == pytest.approx(-radius_m)
    assert heads[-1] == pytest.approx(-radius_m - lengths * record.header.robot.length_m)
    steps = np.diff(heads)
    assert np.ptp(steps) < 0.021 * lengths * record.header.robot.length_m + 1e-9


def test_a_body_is_round_at_its_head_and_thinner_at_its_tail() -> None:
    """Of 10 links of 0.1 m along x; the tail's end has 0.35 of the radius."""
    links = np.column_stack([0.1 * np.arange(10), np.full(10, 2.0)])
    outline = body_outline_m(links, (0.05, 0.06), 0.04)
    assert outline.min(axis=0) == pytest.approx([-0.09, 1.96])
    assert outline.max(axis=0) == pytest.approx([0.96, 2.04])
    beside = outline[outline[:, 0] > -0.05 + 1e-9]
    half_m = np.abs(beside[:, 1] - 2.0)
    share = np.interp(np.linspace(0, 1, 12), [0, 0.75, 1], [0.04, 0.04, 0.014])
    line = np.concatenate([[-0.05], links[:, 0], [0.96]])
    assert half_m == pytest.approx(np.interp(beside[:, 0], line, share))
    cap = outline[outline[:, 0] < -0.05 - 1e-9]
    assert len(cap) >= 7
    assert np.hypot(*(cap - [-0.05, 2.0]).T) == pytest.approx(0.04)
    turned = body_outline_m(links[:, ::-1] * [1.0, -1.0], (0.05, 0.06), 0.04)
    assert turned == pytest.approx(outline[:, ::-1] * [1.0, -1.0])


def test_the_map_leaves_a_margin_around_everything_it_shows(record: RunRecord) -> None:
    axes = axes_of(record)
    plan = record.header.plan
    at = [record.pose.links_m[..., k] for k in range(2)]
    expected = [
        (
            min(np.nanmin(at[k]), plan.path_m[:, k].min(), (plan.waypoints_m[:, k] - radius).min()),
            max(np.nanmax(at[k]), plan.path_m[:, k].max(), (plan.waypoints_m[:, k] + radius).max()),
        )
        for k in range(2)
        for radius in [plan.waypoint_radius_m]
    ]
    for limits, (low, high) in zip((axes.get_xlim(), axes.get_ylim()), expected, strict=True):
        assert limits == pytest.approx((low - 0.35, high + 0.35))


def test_contour_lines_within_the_map_have_their_height(record: RunRecord) -> None:
    """On a plane that rises to the left, a line of a height runs across the map."""
    figure = Figure()
    axes = figure.subplots()
    axes.set_xlim(-0.3, 0.4)
    axes.set_ylim(0.1, 0.9)
    ground = HeightField(np.outer(np.linspace(0.0, 0.4, 9), np.ones(9)), 0.25, -1.0, -1.0)
    draw_ground(axes, ground)
    (lines,) = (each for each in axes.collections if isinstance(each, ContourSet))
    drawn = [(level, path) for level, path in zip(lines.levels, lines.get_paths(), strict=True)]
    shown = [(level, path.vertices) for level, path in drawn if len(path.vertices)]
    assert len(shown) >= 3
    for level, vertices in shown:
        assert np.asarray(vertices)[:, 1] == pytest.approx(5.0 * level - 1.0)
    assert {text.get_text() for text in axes.texts} <= {f"{level:.2f} m" for level in lines.levels}


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
