"""Map of a run: ground, path and waypoints, and the body at several times."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LightSource, Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle, Polygon

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import CENTRE, GREY, HEAD, INK, MEASURED, PATH, REACHED, TO_COME
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import Obstacle
from snakewalk.controller.figures.style import GROUND, WIDTH_IN, legend_above
from snakewalk.controller.metrics.path_error import waypoint_times_s
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import PoseTable

_BODY_SPACING = 1.3  # body lengths between the bodies drawn
_MARGIN_M = 0.35
_POINTS = 20_000
"""Most points of a track (ours)."""
_CURSOR_POINTS = 120
"""Points of the track on which the page moves a cursor; matplotlib thins a line of 128."""
_GRID = 500
"""Points of each axis at which an obstacle is drawn."""
_BODIES = 200
"""Most bodies drawn (ours)."""


def path_figure(record: RunRecord) -> Figure | None:
    """Map in the horizontal plane; None without a pose."""
    pose = record.pose
    if len(pose.time_s) == 0:
        return None
    low, high = _extent(record)
    wide, tall = high - low
    height = float(np.clip(0.86 * WIDTH_IN * tall / wide, 3.2, 7.2))
    figure = Figure(figsize=(WIDTH_IN, height), layout="constrained")
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    if record.header.ground is not None:
        draw_ground(axes, record.header.ground)
    if record.header.world.obstacle is not None:
        _draw_obstacle(axes, record.header.world.obstacle)
    _plan(axes, record)
    _bodies(axes, record)
    step = _step(pose)
    is_measured = record.header.pose_evidence.is_measured
    evidence = "" if is_measured else ", dead-reckoned"
    axes.plot(
        *pose.centre_m[::step, :2].T,
        color=CENTRE,
        linewidth=2.0,
        label=f"centre of mass{evidence}",
        linestyle="-" if is_measured else (0, (3, 2)),
    )
    axes.plot(*pose.head_m[::step, :2].T, color=HEAD, linewidth=0.9, label="head")
    rows = np.flatnonzero(np.isfinite(pose.centre_m[:, 0]))
    rows = rows[np.linspace(0, len(rows) - 1, _CURSOR_POINTS).astype(int)] if len(rows) else rows
    times = " ".join(f"{time_s:.2f}" for time_s in pose.time_s[rows])
    axes.plot(*pose.centre_m[rows, :2].T, alpha=0.0, gid=f"track {times}")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    legend_above(axes, 3)
    return figure


def _step(pose: PoseTable) -> int:
    return -(-len(pose.time_s) // _POINTS)


def _extent(record: RunRecord) -> tuple[Floats, Floats]:
    plan = record.header.plan
    pose = record.pose
    around = [plan.waypoints_m - plan.waypoint_radius_m, plan.waypoints_m + plan.waypoint_radius_m]
    parts = [plan.path_m[:, :2], *around, _corners_m(pose.head_m), _corners_m(pose.links_m)]
    points = np.concatenate(parts)
    points = points[np.isfinite(points).all(axis=1)]
    return points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M


def _corners_m(column: Floats) -> Floats:
    """Least and largest coordinates (2 n, 2) of points (T, ..., 3), of some rows at a time."""

    def corners_m(rows: Floats) -> Floats:
        points = rows.reshape(-1, 3)[:, :2]
        return np.stack([np.fmin.reduce(points), np.fmax.reduce(points)])

    return np.asarray(by_rows(corners_m, column))


def _draw_obstacle(axes: Axes, obstacle: Obstacle) -> None:
    """Fill what stands on the ground; a level obstacle above it has no place there."""
    x, y = (np.linspace(*limits, _GRID) for limits in (axes.get_xlim(), axes.get_ylim()))
    gap_m = obstacle.gap_m(*np.meshgrid(x, y))
    if np.isfinite(gap_m).all() and gap_m.min() < 0.0:
        axes.contourf(x, y, gap_m, levels=[gap_m.min(), 0.0], colors=[INK])
        axes.plot([], [], "s", color=INK, label=obstacle.kind)


def draw_ground(axes: Axes, ground: HeightField) -> None:
    """Draw hills as colours, lighter the higher, with shade, contour lines and a scale."""
    w, h = ground.size_m
    extent = (ground.x0_m, ground.x0_m + w, ground.y0_m, ground.y0_m + h)
    low, high = float(ground.z_m.min()), float(ground.z_m.max())
    heights = ScalarMappable(Normalize(low, max(high, low + 1e-9)), GROUND)
    colour = heights.to_rgba(ground.z_m)
    light = LightSource(azdeg=315, altdeg=50)
    shade = light.hillshade(ground.z_m, vert_exag=1.0, dx=ground.spacing_m, dy=ground.spacing_m)
    shaded = np.clip(colour[..., :3] * (0.86 + 0.18 * shade)[..., None], 0.0, 1.0)
    axes.imshow(shaded, origin="lower", extent=extent, interpolation="bilinear", zorder=0)
    x = np.linspace(extent[0], extent[1], ground.z_m.shape[1])
    y = np.linspace(extent[2], extent[3], ground.z_m.shape[0])
    columns, rows = slice(None), slice(None)
    if not axes.get_autoscalex_on():  # labels only where they are seen
        columns, rows = _slice_within(x, axes.get_xlim()), _slice_within(y, axes.get_ylim())
    lines = axes.contour(
        x[columns],
        y[rows],
        ground.z_m[rows, columns],
        levels=8,
        colors=INK,
        linewidths=0.5,
        alpha=0.5,
    )
    axes.clabel(lines, list(lines.levels)[1::2], fontsize=8.5, fmt="%.2f m")
    axes.grid(visible=False)
    if isinstance(axes.figure, Figure | SubFigure):
        bar = axes.figure.colorbar(heights, ax=axes, pad=0.02, aspect=18, shrink=0.8)
        bar.set_label("height of the ground (m)")
        bar.outline.set_visible(False)


def _slice_within(values: Floats, limits: tuple[float, float]) -> slice:
    first, last = np.searchsorted(values, limits).tolist()
    first = min(max(first, 0), len(values) - 2)
    return slice(first, max(last, first + 2))


def _plan(axes: Axes, record: RunRecord) -> None:
    plan = record.header.plan
    paths = record.paths if len(plan.waypoints_m) else ()
    for number, (_, path) in enumerate(paths):
        label = "planned path" if number == 0 else ("laid again" if number == 1 else None)
        strong = number == 0
        axes.plot(
            *path[:, :2].T,
            color=PATH if strong else GREY,
            linewidth=1.4 if strong else 1.0,
            linestyle=(0, (5, 3)) if strong else (0, (1, 2)),
            label=label,
            zorder=2,
        )
    reached = len(waypoint_times_s(record.pose, plan))
    measured = record.header.pose_evidence.is_measured
    for number, point in enumerate(plan.waypoints_m):
        colour = REACHED if number < reached else TO_COME
        axes.add_patch(
            Circle(
                (float(point[0]), float(point[1])),
                plan.waypoint_radius_m,
                facecolor=colour if measured else "none",
                edgecolor=colour,
                alpha=0.16 if measured else 0.9,
                linestyle="-" if measured else (0, (4, 3)),
                zorder=1,
            )
        )
        axes.annotate(
            str(number + 1),
            point,
            ha="center",
            va="center",
            fontsize=9,
            fontweight="bold",
            color="white" if measured else colour,
            zorder=6,
            bbox={
                "boxstyle": "circle,pad=0.25",
                "facecolor": colour if measured else "white",
                "edgecolor": "white" if measured else colour,
            },
        )


def _bodies(axes: Axes, record: RunRecord) -> None:
    pose = record.pose
    robot = record.header.robot
    indices = np.flatnonzero(
        by_rows(lambda links_m: np.isfinite(links_m).all(axis=(1, 2)), pose.links_m)
    )[:: _step(pose)]
    if len(indices) == 0:
        return
    along_m = np.cumsum(np.hypot(*np.diff(pose.centre_m[indices, :2], axis=0, prepend=[[0, 0]]).T))
    along_m -= along_m[0]
    count = int(along_m[-1] / (_BODY_SPACING * robot.length_m))
    count = 1 + min(max(1, count), _BODIES)
    half_m = 0.5 * robot.link_lengths_m[0], 0.5 * robot.link_lengths_m[-1]
    chosen = indices[np.searchsorted(along_m, np.linspace(0.0, along_m[-1], count))]
    for k, row in enumerate(chosen):
        strength = 0.25 + 0.6 * k / max(len(chosen) - 1, 1)
        outline = body_outline_m(pose.links_m[row, :, :2], half_m, robot.body_radius_m)
        axes.add_patch(
            Polygon(
                outline,
                closed=True,
                facecolor=MEASURED,
                edgecolor="white",
                linewidth=0.7,
                alpha=strength,
                zorder=3,
                label=f"body, {len(chosen)} times" if k == len(chosen) - 1 else None,
            )
        )


def body_outline_m(links_m: Floats, half_m: tuple[float, float], radius_m: float) -> Floats:
    """Outline (n, 2) of a body along link centres (L, 2): round head, tapering tail.

    ``half_m`` are half the lengths of the head and of the tail.
    """
    first = _unit(links_m[0] - links_m[1])
    last = _unit(links_m[-1] - links_m[-2])
    line = np.vstack([links_m[0] + half_m[0] * first, links_m, links_m[-1] + half_m[1] * last])
    tangent = _unit(np.gradient(-line, axis=0))  # towards the head
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    radius = radius_m * np.interp(np.linspace(0, 1, len(line)), [0, 0.75, 1], [1, 1, 0.35])
    left, right = line + radius[:, None] * normal, line - radius[:, None] * normal
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)[1:-1]
    cap = line[0] + radius[0] * (np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * normal[0])
    return np.vstack([right[::-1], cap, left])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
