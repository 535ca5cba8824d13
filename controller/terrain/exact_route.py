"""Exact routes: a path over safe ground wherever one exists, however narrow.

The risk is bilinear between the samples of the height field. Lines through all samples, the
planner's margin and both ends cut the ground into cells with bilinear risk. From any safe point of
a cell, moving along one axis and then the other without growing risk leads to a safe corner. Two
points are therefore joined by safe ground if and only if edges of cells join them, or saddles
between opposite corners of a cell.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices, Ints
from snakewalk.controller.terrain.dijkstra import shortest_tree
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.relief import Relief
from snakewalk.controller.terrain.safe_graph import SAMPLE_M, SafeGraph

SAFE_RISK = 1.0 - 1e-9
"""Risk of nodes and saddles; the reserve covers the rounding of interpolated values."""
_SAMPLES_IN_STEP = 10_000
_UNITS = 1000
_NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Rows and columns from a node to the neighbours with higher numbers."""


def exact_route(
    relief: Relief, graph: SafeGraph, start_m: Floats, end_m: Floats
) -> Steps[Floats | None]:
    """(n, 2) corners of the cheapest safe path along cells, both ends included, or None.

    Straight safe pieces join the corners. An unsafe start is joined straight to the nearest safe
    node that can reach the end.

    Args:
        relief: risk of the ground.
        graph: gives the cost of edges.
        start_m: (2,)
        end_m: (2,) on safe ground.

    """
    cells = _cells(relief, start_m, end_m)
    if cells is None:
        return None
    for rows in cells.bands():
        yield _UNITS
        cells.risk[rows] = relief.risk(*np.meshgrid(cells.x_m, cells.y_m[rows]))
        cells.safe[rows] = cells.risk[rows] <= SAFE_RISK
    for end, point in zip(cells.ends, (start_m, end_m), strict=True):
        cells.safe.flat[end] |= bool(relief.safe(*point))
    ends, weights = yield from _arcs(cells, graph)
    start, end = cells.ends
    starts = np.arange(0, ends.size + 1, ends.shape[1])
    score, towards = yield from shortest_tree(starts, ends.ravel(), weights.ravel(), end)
    yield _UNITS
    if not relief.safe(*start_m):
        gap = np.hypot(*np.meshgrid(cells.x_m - start_m[0], cells.y_m - start_m[1])).ravel()
        start = int(np.argmin(np.where(np.isfinite(score), gap, np.inf)))
    if not np.isfinite(score[start]):
        return None
    corners = [start_m, *cells.corners(start, end, towards)]
    return _distinct(np.array(corners))


class _Cells(NamedTuple):
    """Lines (w,) and (h,) between cells, whose crossings are the nodes."""

    x_m: Floats
    y_m: Floats
    risk: Floats
    """(h, w)"""
    safe: Bools
    """(h, w)"""
    saddle_x_m: Floats
    """(h - 1, w - 1) x of the safe saddle between two safe corners of a cell, or NaN."""
    ends: tuple[int, int]
    """Numbers of the nodes at start and end."""
    longest_m: float
    """Length that no diagonal of a cell exceeds."""

    def bands(self) -> list[slice]:
        """Rows of nodes, cut into pieces for a step."""
        height, width = self.safe.shape
        samples = 2.0 + self.longest_m / SAMPLE_M
        rows = max(1, int(_SAMPLES_IN_STEP / samples / width))
        return [slice(row, min(row + rows, height)) for row in range(0, height, rows)]

    def corners(self, start: int, end: int, towards: Indices) -> Iterator[Floats]:
        """Places (2,) of nodes and saddles from one node to another."""
        width = len(self.x_m)
        row, column = divmod(start, width)
        yield np.array([self.x_m[column], self.y_m[row]])
        while row * width + column != end:
            next_row, next_column = divmod(int(towards[row * width + column]), width)
            if row != next_row and column != next_column:
                x = self.saddle_x_m[min(row, next_row), min(column, next_column)]
                if not np.isnan(x):
                    yield from (np.array([x, self.y_m[r]]) for r in (row, next_row))
            row, column = next_row, next_column
            yield np.array([self.x_m[column], self.y_m[row]])


def _cells(relief: Relief, start: Floats, end: Floats) -> _Cells | None:
    """Cells of the ground within the margin, or None; their risk is not computed yet."""
    ground = relief.ground
    margin = relief.config.edge_margin_m
    lines = []
    points = np.stack([start, end])
    for axis, low in enumerate((ground.x0_m, ground.y0_m)):
        count = ground.z_m.shape[1 - axis]
        near, far = low + margin, low + ground.size_m[axis] - margin
        if near > far:
            return None
        samples = low + np.arange(count) * ground.spacing_m
        inside = samples[(samples > near) & (samples < far)]
        through = np.clip(points[:, axis], near, far)
        lines.append(np.unique(np.concatenate([[near, far], inside, through])))
    x, y = lines
    shape = len(y), len(x)
    columns = np.abs(x - points[:, :1]).argmin(axis=1)
    rows = np.abs(y - points[:, 1:]).argmin(axis=1)
    first, last = (rows * len(x) + columns).tolist()
    saddle_x_m = np.empty((shape[0] - 1, shape[1] - 1))
    return _Cells(
        x,
        y,
        np.empty(shape),
        np.empty(shape, bool),
        saddle_x_m,
        (first, last),
        1.5 * ground.spacing_m,
    )


def _arcs(cells: _Cells, graph: SafeGraph) -> Steps[tuple[Ints, Floats]]:
    """Ends (n, 8) and weights (n, 8) of the arcs of each node; infinite without an arc.

    An arc leads against the direction of travel, as the tree grows from the target.
    """
    width = len(cells.x_m)
    shape = cells.safe.size, 2 * len(_NEIGHBOURS)
    ends, weights = np.empty(shape, np.int64), np.empty(shape)
    for rows in cells.bands():
        yield _UNITS
        nodes = slice(rows.start * width, rows.stop * width)
        ends[nodes] = np.arange(nodes.start, nodes.stop)[:, None]
        weights[nodes] = np.inf
    for rows in cells.bands():
        _add_saddles(cells, rows)
        for k in range(len(_NEIGHBOURS)):
            yield _UNITS
            a, b, there, back = _joined(cells, graph, rows, *_NEIGHBOURS[k])
            ends[a, k], weights[a, k] = b, back
            ends[b, ~k], weights[b, ~k] = a, there
    return ends, weights


def _add_saddles(cells: _Cells, band: slice) -> None:
    """Write the saddles of the cells above the rows of a band."""
    some = slice(band.start, min(band.stop, len(cells.y_m) - 1))
    above = slice(some.start + 1, some.stop + 1)
    f, g = cells.risk[some], cells.risk[above]
    safe, over = cells.safe[some], cells.safe[above]
    a, b, c = f[:, :-1], f[:, 1:] - f[:, :-1], g[:, :-1] - f[:, :-1]
    d = g[:, 1:] - g[:, :-1] - b
    with np.errstate(all="ignore"):
        u, v = -c / d, -b / d
        joins = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (a - b * c / d <= SAFE_RISK)
        joins &= (safe[:, :-1] == over[:, 1:]) & (safe[:, 1:] == over[:, :-1])
        joins &= safe[:, :-1] != safe[:, 1:]
        cells.saddle_x_m[some] = np.where(joins, cells.x_m[:-1] + u * np.diff(cells.x_m), np.nan)


def _joined(
    cells: _Cells, graph: SafeGraph, band: slice, up: int, right: int
) -> tuple[Indices, Indices, Floats, Floats]:
    """Nodes (k,) of a band's rows, neighbours (k,) that safe ground joins to them, and costs."""
    height, width = cells.safe.shape
    rows = np.arange(band.start, min(band.stop, height - up))[:, None]
    columns = np.arange(max(0, -right), width - max(0, right))
    joined = cells.safe[rows, columns] & cells.safe[rows + up, columns + right]
    if up and right:
        sides = cells.safe[rows, columns + right] & cells.safe[rows + up, columns]
        joined &= sides | ~np.isnan(cells.saddle_x_m[rows, columns + min(0, right)])
    row, column = np.nonzero(joined)
    row += band.start
    column += columns[0]
    a, b = row * width + column, (row + up) * width + column + right
    from_m = np.stack([cells.x_m[column], cells.y_m[row]], axis=-1)
    to_m = np.stack([cells.x_m[column + right], cells.y_m[row + up]], axis=-1)
    there, back, _ = graph.edge_cost(from_m, to_m, cells.longest_m)
    return a, b, there, back


def _distinct(points: Floats) -> Floats:
    is_distinct = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-9])
    return np.asarray(points[is_distinct])
