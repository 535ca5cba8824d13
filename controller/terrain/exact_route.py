"""Exact routes: a path over safe ground wherever one exists, however narrow.

The risk is bilinear between the samples of the height field. Lines through all samples, the
planner's margin and both ends cut the ground into cells with bilinear risk. From any safe point of
a cell, moving along one axis and then the other without growing risk leads to a safe corner. Two
points are therefore joined by safe ground if and only if edges of cells join them, or saddles
between opposite corners of a cell.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.controller.terrain.relief import Relief
from snakewalk.controller.terrain.safe_graph import SafeGraph

SAFE_RISK = 1.0 - 1e-9
"""Risk of nodes and saddles; the reserve covers the rounding of interpolated values."""
_CHUNK = 200_000


def exact_route(relief: Relief, graph: SafeGraph, start_m: Floats, end_m: Floats) -> Floats | None:
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
    edges = _edges(cells)
    width = len(cells.x_m)
    index = np.arange(cells.safe.size)
    nodes_m = np.stack([cells.x_m[index % width], cells.y_m[index // width]], axis=-1)
    start, end = cells.ends
    score, towards = _tree(nodes_m, edges, graph, end)
    lead = [start_m]
    if not relief.safe(*start_m):
        gap = np.where(np.isfinite(score), np.hypot(*(nodes_m - start_m).T), np.inf)
        start = int(np.argmin(gap))
    if not np.isfinite(score[start]):
        return None
    saddles = {
        (int(a), int(b)): float(x)
        for a, b, x in zip(*(part[~np.isnan(edges.saddle_x_m)] for part in edges), strict=True)
    }
    current = start
    corners = [*lead, nodes_m[start]]
    while current != end:
        onward = int(towards[current])
        x = saddles.get((current, onward), saddles.get((onward, current)))
        if x is not None:
            corners += [np.array([x, nodes_m[node][1]]) for node in (current, onward)]
        corners.append(nodes_m[onward])
        current = onward
    return _distinct(np.array(corners))


class _Cells(NamedTuple):
    """Lines (w,) and (h,), risk and safety (h, w) of crossings, and the numbers of both ends."""

    x_m: Floats
    y_m: Floats
    risk: Floats
    safe: Bools
    ends: tuple[int, int]


class _Edges(NamedTuple):
    """Joined nodes (k,) and (k,), and (k,) x of the saddle between them or NaN."""

    a: Indices
    b: Indices
    saddle_x_m: Floats


def _cells(relief: Relief, start: Floats, end: Floats) -> _Cells | None:
    """Cells of the ground within the margin, or None."""
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
    risk = relief.risk(*np.meshgrid(x, y))
    safe = risk <= SAFE_RISK
    numbers = []
    for point in points:
        column = int(np.argmin(np.abs(x - point[0])))
        row = int(np.argmin(np.abs(y - point[1])))
        safe[row, column] |= bool(relief.safe(*point))
        numbers.append(row * len(x) + column)
    return _Cells(x, y, risk, safe, (numbers[0], numbers[1]))


def _edges(cells: _Cells) -> _Edges:
    """Sides of cells between safe corners, diagonals of safe cells, and paths over saddles."""
    safe = cells.safe
    number = np.arange(cells.safe.size).reshape(cells.safe.shape)
    corners = safe[:-1, :-1], safe[:-1, 1:], safe[1:, :-1], safe[1:, 1:]
    all_safe = corners[0] & corners[1] & corners[2] & corners[3]
    lower_left, lower_right = number[:-1, :-1], number[:-1, 1:]
    upper_left, upper_right = number[1:, :-1], number[1:, 1:]
    across, along = safe[:, :-1] & safe[:, 1:], safe[:-1, :] & safe[1:, :]
    pairs = [
        (number[:, :-1][across], number[:, 1:][across]),
        (number[:-1, :][along], number[1:, :][along]),
        (lower_left[all_safe], upper_right[all_safe]),
        (lower_right[all_safe], upper_left[all_safe]),
    ]
    plain = sum(len(pair[0]) for pair in pairs)
    x_m = _saddles_m(cells)
    rising = ~np.isnan(x_m) & corners[0] & corners[3] & ~corners[1] & ~corners[2]
    falling = ~np.isnan(x_m) & corners[1] & corners[2] & ~corners[0] & ~corners[3]
    pairs += [
        (lower_left[rising], upper_right[rising]),
        (lower_right[falling], upper_left[falling]),
    ]
    return _Edges(
        np.concatenate([pair[0] for pair in pairs]),
        np.concatenate([pair[1] for pair in pairs]),
        np.concatenate([np.full(plain, np.nan), x_m[rising], x_m[falling]]),
    )


def _saddles_m(cells: _Cells) -> Floats:
    """(h - 1, w - 1) x of each cell's saddle if it is in the cell and safe, else NaN."""
    f = cells.risk
    a, b, c = f[:-1, :-1], f[:-1, 1:] - f[:-1, :-1], f[1:, :-1] - f[:-1, :-1]
    d = f[1:, 1:] - f[1:, :-1] - b
    with np.errstate(all="ignore"):
        u, v = -c / d, -b / d
        safe = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (a - b * c / d <= SAFE_RISK)
    return np.where(safe, cells.x_m[:-1] + u * np.diff(cells.x_m), np.nan)


def _tree(nodes_m: Floats, edges: _Edges, graph: SafeGraph, target: int) -> tuple[Floats, Indices]:
    """Cost (n,) to the target and the next node (n,) towards it."""
    there = np.empty(len(edges.a))
    back = np.empty(len(edges.a))
    for begin in range(0, len(edges.a), _CHUNK):
        piece = slice(begin, begin + _CHUNK)
        from_m, to_m = nodes_m[edges.a[piece]], nodes_m[edges.b[piece]]
        there[piece], back[piece], _ = graph.edge_cost(from_m, to_m)
    n = len(nodes_m)
    weight = np.maximum(np.concatenate([there, back]), 1e-12)  # a sparse zero would be no edge
    ends = np.concatenate([edges.b, edges.a]), np.concatenate([edges.a, edges.b])
    score, towards = dijkstra(
        csr_array(coo_array((weight, ends), shape=(n, n))),
        directed=True,
        indices=[target],
        return_predecessors=True,
    )
    return score[0], towards[0].astype(np.intp)


def _distinct(points: Floats) -> Floats:
    is_distinct = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-9])
    return np.asarray(points[is_distinct])
