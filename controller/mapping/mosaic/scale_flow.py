"""Dense flow between wide-baseline pictures: labels (dx, dy, scale) of least energy ([KP] 3.4.1).

The paper minimises ``D = corr``, whose least value is the worst match. This module uses
``D = 1 - corr`` (docs/papers.md).
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints, Singles
from snakewalk.controller.mapping.mosaic.labelling import Costs, flow_of, labelled
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, project
from snakewalk.controller.mapping.mosaic.relative_pose import RelativePose
from snakewalk.controller.mapping.mosaic.scale_matches import SCALES, grey, reduced
from snakewalk.drivers.compiling import compiled, readonly_array

STRIDE_PX = 3
"""Distance of the labelled pixels (ours)."""
SEARCH_PX = 6
"""Half the width of ``R_p`` (ours)."""
ZONE_PX = 2.5
"""Half the width of the zone around an epipolar line (ours)."""
PATCH_PX = 3
"""Radius of a patch (ours)."""
PENALTY = 0.12
"""Potts constant (ours), of data terms from 0 to 2."""
LEAST_CORRELATION = 0.5
"""Correlation below which a pixel has no physical counterpart (ours)."""

Picture = Singles


@dataclass(frozen=True, slots=True)
class FlowProblem:
    """Data terms of the labels of a grid of pixels."""

    rows: Ints
    """Rows of the grid in the first picture."""
    columns: Ints
    costs: Costs
    base: Ints
    """(rows, columns, 2) flow of the first place of each window: column, row."""
    expected_px: Floats
    """(rows, columns, 2) flow by geometry and pose alone."""
    scales: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ScaleFlow:
    """Flow of the labelled pixels of the first picture."""

    rows: Ints
    columns: Ints
    flow_px: Floats
    """(rows, columns, 2); NaN without a label."""
    scale: Floats
    """(rows, columns); NaN without a label."""
    correlation: Floats
    """(rows, columns) of the chosen labels."""


def flow_problem(
    first: LocalModel,
    second: LocalModel,
    pose: RelativePose,
    scales: tuple[float, ...] = SCALES,
    stride_px: int = STRIDE_PX,
    search_px: int = SEARCH_PX,
) -> FlowProblem:
    """Data terms of all labels ``LABELS_p = {q - p: q in SEARCH_p} x S``.

    ``SEARCH_p`` is the part of a square around the reprojection of p near its epipolar line and in
    the valid region of the second model.
    """
    tall, wide = first.valid.shape
    rows, columns = (
        np.arange(stride_px // 2, tall, stride_px),
        np.arange(stride_px // 2, wide, stride_px),
    )
    pixel = np.stack(np.meshgrid(columns, rows), axis=-1)
    points_m = first.points_m[rows[:, None], columns[None]]
    projected_px = project(second.camera, pose.moved(points_m))
    expected = projected_px - pixel
    base = (
        np.where(np.isfinite(projected_px), np.rint(projected_px), -10_000).astype(np.int64)
        - search_px
    )
    lines = _epipolar_lines(second.camera, pose, points_m)
    size = 2 * search_px + 1
    costs = np.full((len(rows), len(columns), len(scales), size, size), np.inf, np.float32)
    grey_first = grey(first.image)
    two = grey(second.image)
    for k, scale in enumerate(scales):
        _data_terms(
            grey_first,
            reduced(two, scale),
            scale,
            second.valid,
            pixel,
            base,
            lines,
            PATCH_PX,
            ZONE_PX,
            costs[:, :, k],
        )
    return FlowProblem(rows, columns, costs, base - pixel, expected, scales)


def solve_flow(problem: FlowProblem, penalty: float = PENALTY, printed: bool = False) -> ScaleFlow:
    """Flow of least energy.

    ``printed`` compares flows as printed. Otherwise neighbours are compared by the deviation from
    the flow that geometry and pose predict, so a flow that grows across a plane costs nothing.
    """
    base = problem.base if printed else np.zeros_like(problem.base)
    labels = labelled(problem.costs, base, penalty)
    return flow_of_labels(problem, labels)


def flow_of_labels(problem: FlowProblem, labels: Ints) -> ScaleFlow:
    """Flow, scale and correlation of labels (rows, columns).

    The vertex of a parabola through the data terms of a label and its neighbours gives the fraction
    of a pixel.
    """
    flow_px, index = flow_of(problem.costs, problem.base, labels)
    flow_px = flow_px + _fractions(problem.costs, labels)
    has = labels >= 0
    scale = np.where(has, np.array(problem.scales)[np.maximum(index, 0)], np.nan)
    flat = problem.costs.reshape(*labels.shape, -1)
    data = np.take_along_axis(flat, np.maximum(labels, 0)[..., None], axis=2)[..., 0]
    correlation = np.where(has, 1.0 - data.astype(float), np.nan)
    return ScaleFlow(problem.rows, problem.columns, flow_px, scale, correlation)


def _fractions(costs: Costs, labels: Ints) -> Floats:
    """(rows, columns, 2) offsets of the least cost from a label's place, within half a pixel.

    An offset is 0 if a neighbour is outside SEARCH or has a lower cost.
    """
    high, wide = costs.shape[3:]
    scale, place = np.divmod(np.maximum(labels, 0), high * wide)
    y, x = np.divmod(place, wide)
    row, column = np.indices(labels.shape)
    out = np.zeros((*labels.shape, 2))
    middle = costs[row, column, scale, y, x].astype(float)
    for axis, (down, right) in enumerate(((0, 1), (1, 0))):
        inside = (np.minimum(y - down, x - right) >= 0) & (y + down < high) & (x + right < wide)
        below, above = (
            costs[
                row,
                column,
                scale,
                np.clip(y + sign * down, 0, high - 1),
                np.clip(x + sign * right, 0, wide - 1),
            ].astype(float)
            for sign in (-1, 1)
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            curve = below - 2.0 * middle + above
            offset = 0.5 * (below - above) / curve
            good = inside & np.isfinite(curve) & (middle <= below) & (middle <= above) & (curve > 0)
        out[..., axis] = np.where(good, offset, 0.0)
    return out


def _epipolar_lines(camera: Floats, pose: RelativePose, points_m: Floats) -> Floats:
    """(..., 3) lines ``a u + b v + c = 0`` of unit normals in the second picture."""
    near, far = (pose.moved(points_m * factor) for factor in (1.0, 1.5))
    across = np.cross(near, far) @ np.linalg.inv(camera)
    size = np.hypot(across[..., 0], across[..., 1])[..., None]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.ascontiguousarray(across / size)


@compiled(
    f"void({readonly_array('float32', 2, 'C')}, {readonly_array('float32', 2, 'C')}, float64,"
    f" {readonly_array('bool_', 2, 'A')}, {readonly_array('int64', 3, 'C')},"
    f" {readonly_array('int64', 3, 'C')}, {readonly_array('float64', 3, 'C')},"
    " int64, float64, float32[:, :, :, :])"
)
def _data_terms(  # noqa: C901  a compiled loop
    first_picture: Picture,
    two: Picture,
    scale: float,
    valid: Bools,
    pixel: Ints,
    base: Ints,
    lines: Floats,
    radius: int,
    zone_px: float,
    costs: Costs,
) -> None:
    """Write ``1 - corr`` of the patches at each place of each window at one scale."""
    rows, columns, high, wide = costs.shape
    count = (2 * radius + 1) ** 2
    patch = np.empty(count)
    for row in range(rows):
        for column in range(columns):
            u, v = pixel[row, column, 0], pixel[row, column, 1]
            if not (
                radius <= v < first_picture.shape[0] - radius
                and radius <= u < first_picture.shape[1] - radius
            ) or np.isnan(lines[row, column, 0]):
                continue
            n = 0
            mean = 0.0
            for y in range(-radius, radius + 1):
                for x in range(-radius, radius + 1):
                    patch[n] = first_picture[v + y, u + x]
                    mean += patch[n]
                    n += 1
            mean /= count
            size = 0.0
            for k in range(count):
                patch[k] -= mean
                size += patch[k] * patch[k]
            if size < 1.0:
                continue
            for dy in range(high):
                for dx in range(wide):
                    q_u, q_v = base[row, column, 0] + dx, base[row, column, 1] + dy
                    if not (0 <= q_v < valid.shape[0] and 0 <= q_u < valid.shape[1]):
                        continue
                    off = (
                        lines[row, column, 0] * q_u
                        + lines[row, column, 1] * q_v
                        + lines[row, column, 2]
                    )
                    if not valid[q_v, q_u] or abs(off) > zone_px:
                        continue
                    s_u, s_v = q_u / scale, q_v / scale
                    i, j = int(s_v) - radius, int(s_u) - radius
                    if (
                        i < 0
                        or j < 0
                        or i + 2 * radius + 1 >= two.shape[0]
                        or j + 2 * radius + 1 >= two.shape[1]
                    ):
                        continue
                    f_v, f_u = s_v - int(s_v), s_u - int(s_u)
                    a, b = (1 - f_v) * (1 - f_u), (1 - f_v) * f_u
                    c, d = f_v * (1 - f_u), f_v * f_u
                    total = square = product = 0.0
                    k = 0
                    for y in range(i, i + 2 * radius + 1):
                        for x in range(j, j + 2 * radius + 1):
                            value = (
                                a * two[y, x]
                                + b * two[y, x + 1]
                                + c * two[y + 1, x]
                                + d * two[y + 1, x + 1]
                            )
                            total += value
                            square += value * value
                            product += value * patch[k]
                            k += 1
                    spread = square - total * total / count
                    if spread < 1.0:
                        continue
                    costs[row, column, dy, dx] = 1.0 - product / np.sqrt(size * spread)
