"""The graph of safe nodes, and the cheapest paths through it ([PT] 2.6.1, [KP] 4.3).

Footprint: slopes under a body that follows a path, and the distance to steep ground.

A bending body covers a strip about half its length wide. A slope across the path makes it roll or
slide; a slope along it stops it. The path alone shows neither: a valley is level along its bottom.
"""

from copy import copy
from typing import Self

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.dijkstra import shortest_tree
from snakewalk.controller.terrain.in_steps import Steps, at_once
from snakewalk.controller.terrain.relief import (
    EDGE_TOLERANCE_M,
    Relief,
    fitted_gradient,
    interpolated,
    windowed_mean,
    write_bilinear,
)
from snakewalk.drivers.compiling import compiled, readonly_array


class Footprint:
    """Slopes in a disc of diameter ``footprint_m``; exact on samples, bilinear between them."""

    def __init__(self, ground: HeightField, config: PlannerConfig) -> None:
        self._ground = ground
        radius_m = config.footprint_m / 2.0
        x, y = fitted_gradient(ground, config.slope_window_m)
        squares = [windowed_mean(ground, a * b, radius_m) for a, b in ((x, x), (x, y), (y, y))]
        mean_x, mean_y = fitted_gradient(ground, radius_m)
        self._layers = np.stack([mean_x, mean_y, *squares], axis=-1)
        steep = np.hypot(mean_x, mean_y) > np.tan(config.climb_limit_rad)
        if ground.known is not None:
            steep |= ~ground.known
        self._nearness = np.zeros(ground.z_m.shape)
        if steep.any():
            far_m = np.asarray(distance_transform_edt(~steep, sampling=ground.spacing_m), float)
            far = far_m / max(config.clearance_m, ground.spacing_m)
            self._nearness = np.maximum(1.0 - far, 0.0) ** 2

    @property
    def layers(self) -> Floats:
        """(rows, columns, 6) slopes x, y, their mean squares xx, xy, yy, and nearness.

        Nearness is 1 on ground that is unknown or steeper than the climb limit (under the whole
        footprint), and falls to 0 over the clearance.
        """
        return np.concatenate([self._layers, self._nearness[..., None]], axis=-1)

    def slope_rad(self, points_m: Floats) -> Floats:
        """Inclination (...) of the plane fitted to the footprint at points (..., 2)."""
        x, y = np.moveaxis(points_m, -1, 0)
        layers = interpolated(self._ground, self._layers, x, y)
        return np.arctan(np.hypot(layers[..., 0], layers[..., 1]))

    def slopes(self, points_m: Floats, direction: Floats) -> Floats:
        """Tangents (2, ...) of the slope up along a direction, and of the RMS slope across it.

        The slope up is that of the plane fitted to the footprint. The slope across is a root mean
        square, so that the two sides of a valley do not cancel.

        Args:
            points_m: (..., 2) in the world.
            direction: (..., 2) unit vectors of travel.

        """
        layers = interpolated(self._ground, self._layers, *np.moveaxis(points_m, -1, 0))
        gx, gy, xx, xy, yy = np.moveaxis(layers, -1, 0)
        dx, dy = np.moveaxis(direction, -1, 0)
        across = xx * dy**2 - 2.0 * xy * dx * dy + yy * dx**2
        return np.stack([gx * dx + gy * dy, np.sqrt(np.maximum(across, 0.0))])


# A reserve for nodes and edges: the spline may leave the polygon slightly.
RISK_LIMIT = 0.9

# Half of the sixteen neighbours; the others are the same edges reversed.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (2, -1), (1, -2))
SAMPLE_M = 0.05
"""Largest distance between the points at which an edge is weighed."""
_AVOID = 30.0
"""Metres of level path that a metre through an avoided place costs more."""
_EDGES_IN_STEP = 5000


class SafeGraph:
    """Safe nodes on a grid, joined to up to sixteen neighbours; built once, searched often.

    The printed weight of an edge (variance of the elevation along it) is zero along every contour
    and grows with the square of the length. Here a metre of an edge weighs the *windowed* variance
    per node spacing, and ``length_weight`` times

        1 + climb_weight (up / limit)^4 + side_weight (side / limit)^4
          + clearance_weight (1 - distance to ground that cannot be climbed / clearance)^2,

    where up (along the edge) and side (across it) are the footprint's slopes; they and the climb
    limit are tangents. Cutting an edge in two changes nothing. The power penalises slopes over the
    limit in every direction: hairpins shorter than the body would satisfy a limit of the climb
    alone.
    """

    def __init__(self, relief: Relief) -> None:
        self._relief = relief
        self.footprint = Footprint(relief.ground, relief.config)
        """Slopes under the body, by which edges are weighed."""
        self.length_weight = relief.config.length_weight
        """Weight of a metre of path on level ground."""
        ground = relief.ground
        config = relief.config
        w, h = (size - 2.0 * config.edge_margin_m for size in ground.size_m)
        x = _centred_grid(ground.middle_m[0], w, config.node_spacing_m)
        y = _centred_grid(ground.middle_m[1], h, config.node_spacing_m)
        xx, yy = np.meshgrid(x, y)
        safe = relief.risk(xx, yy) <= RISK_LIMIT
        index = np.where(safe, np.cumsum(safe).reshape(safe.shape) - 1, -1)
        self.nodes_m = np.stack([xx[safe], yy[safe]], axis=-1)
        """(n, 2) safe nodes."""
        self.place = np.flatnonzero(safe)
        """(n,) number of each node in the grid of all nodes, which graphs of one area share."""
        self.safe_share = float(safe.mean()) if safe.size else 0.0
        """Safe nodes over all nodes inside the margin."""
        self._avoid_m = np.empty((0, 2))
        self._layers = np.concatenate([relief.layers, self.footprint.layers], axis=-1)
        self._layers[..., -1] += relief.obstacle_cost
        self._edges = self._joined_costs(index)
        self._trees: dict[int, tuple[Floats, Indices]] = {}

    def avoiding_in_steps(self, places_m: Floats) -> Steps[Self]:
        """Return this graph with an extra cost within a footprint of places (k, 2)."""
        if len(places_m) == 0:
            return self
        graph = copy(self)
        edges = self._edges
        graph._avoid_m = np.asarray(places_m, float)
        graph._trees = {}
        yield 500
        rows = np.repeat(np.arange(len(self.nodes_m)), np.diff(edges.indptr))
        weights = edges.data.copy()
        for k in range(0, len(weights), _EDGES_IN_STEP):
            yield 300 + 500 * len(places_m)
            some = slice(k, k + _EDGES_IN_STEP)
            from_m, to_m = self.nodes_m[edges.indices[some]], self.nodes_m[rows[some]]
            length = np.hypot(*(to_m - from_m).T)
            weights[some] += self.length_weight * length * graph._detour_cost(0.5 * (from_m + to_m))
        yield 300
        graph._edges = csr_array((weights, edges.indices, edges.indptr), shape=edges.shape)
        return graph

    def _detour_cost(self, points_m: Floats) -> Floats:
        """Extra metres (...) per metre of path at points (..., 2) near avoided places."""
        total = np.zeros(points_m.shape[:-1])
        for place in self._avoid_m:
            far = np.hypot(*np.moveaxis(points_m - place, -1, 0))
            total += _AVOID * np.maximum(1.0 - far / self._relief.config.footprint_m, 0.0) ** 2
        return total

    def nearest(self, point_m: Floats, among: Bools | None = None) -> int | None:
        """Return the safe node nearest to a point, or None."""
        gap = np.hypot(*(self.nodes_m - point_m).T)
        if among is not None:
            gap = np.where(among, gap, np.inf)
        if not np.isfinite(gap).any():
            return None
        return int(np.argmin(gap))

    def can_reach(self, target: int) -> Bools:
        """(n,) nodes from which ``target`` can be reached."""
        return np.isfinite(self.costs_to(target))

    def tree_in_steps(self, target: int) -> Steps[None]:
        """Prepare ``can_reach`` and ``cheapest_path`` for a target.

        Cached: replanning keeps the waypoints and changes the start.
        """
        if target in self._trees:
            return
        edges = self._edges
        tree = yield from shortest_tree(
            edges.indptr.astype(np.int64), edges.indices.astype(np.int64), edges.data, target
        )
        self._trees[target] = tree

    def costs_to(self, target: int) -> Floats:
        """(n,) cost of the cheapest path to ``target``; infinite without a path."""
        at_once(self.tree_in_steps(target))
        return self._trees[target][0]

    def costs_from(self, point_m: Floats, reach_m: float) -> Floats:
        """(n,) cost of the cheapest path to each node from a point, safe or not.

        The path begins straight to a node within ``reach_m``, or to the nearest one.
        """
        gap = np.hypot(*(self.nodes_m - point_m).T)
        first = np.flatnonzero(gap <= max(reach_m, float(gap.min(initial=np.inf))))
        n = len(self.nodes_m)
        edges = self._edges.tocoo()
        weight = np.concatenate([edges.data, self.length_weight * gap[first]])
        ends = (
            np.concatenate([edges.col, np.full(len(first), n)]),
            np.concatenate([edges.row, first]),
        )
        both = csr_array(coo_array((weight, ends), shape=(n + 1, n + 1)))
        return dijkstra(both, directed=True, indices=[n])[0, :n]

    def cheapest_path(self, start: int, target: int) -> Floats | None:
        """(m, 2) nodes of the cheapest path, both ends included, or None."""
        if not np.isfinite(self.costs_to(target)[start]):
            return None
        towards = self._trees[target][1]
        nodes = [start]
        while nodes[-1] != target:
            nodes.append(int(towards[nodes[-1]]))
        return self.nodes_m[nodes]

    def edge_cost(
        self, from_m: Floats, to_m: Floats, least_longest_m: float = 0.0
    ) -> tuple[Floats, Floats, Bools]:
        """Costs of straight pieces (k, 2) to (k, 2), of the reverse, and whether they are safe.

        All pieces have as many samples as the longest one, or one of ``least_longest_m``.
        """
        length = np.hypot(*(to_m - from_m).T)
        longest_m = float(length.max(initial=least_longest_m))
        count = max(2, int(np.ceil(longest_m / SAMPLE_M)) + 1)
        part = np.linspace(0.0, 1.0, count)
        samples_m = np.empty((len(from_m), count, 2))
        for axis in range(2):  # numpy is slow with an innermost axis of two values
            step = np.multiply.outer(to_m[:, axis] - from_m[:, axis], part)
            np.add(from_m[:, axis, None], step, out=samples_m[..., axis])
        direction = (to_m - from_m) / np.maximum(length, 1e-12)[:, None]
        there, back, risk = self._cost_per_m(
            samples_m, np.repeat(direction[:, None], count, axis=1)
        )
        safe = (risk <= RISK_LIMIT).all(axis=-1)
        return length * there.mean(axis=-1), length * back.mean(axis=-1), np.asarray(safe)

    def cost_per_m(self, points_m: Floats) -> Floats:
        """Cost (..., k) of a metre of path at points (..., k, 2) along curves, safe or not."""
        step = np.gradient(points_m, axis=-2)
        length = np.hypot(step[..., 0], step[..., 1])
        return self._cost_per_m(points_m, step / np.maximum(length, 1e-12)[..., None])[0]

    def _cost_per_m(self, points_m: Floats, direction: Floats) -> tuple[Floats, Floats, Floats]:
        """Cost (...) of a metre along unit vectors (..., 2), of one against, and the risk."""
        ground = self._relief.ground
        config = self._relief.config
        w, h = ground.size_m
        margin = config.edge_margin_m - EDGE_TOLERANCE_M
        shape = points_m.shape[:-1]
        count = points_m[..., 0].size
        there = np.empty(count)
        back = np.empty(count)
        risk = np.empty(count)
        _weigh(
            self._layers,
            (ground.x0_m, ground.y0_m, ground.spacing_m),
            (margin, margin, w - margin, h - margin),
            (
                1.0 / config.node_spacing_m,
                self.length_weight,
                self.length_weight * config.clearance_weight,
                self.length_weight * config.side_weight,
                self.length_weight * config.climb_weight,
                float(np.tan(config.climb_limit_rad)),
            ),
            np.ascontiguousarray(points_m).reshape(-1, 2),
            np.ascontiguousarray(direction).reshape(-1, 2),
            there,
            back,
            risk,
        )
        more = self.length_weight * self._detour_cost(points_m) if len(self._avoid_m) else 0.0
        return there.reshape(shape) + more, back.reshape(shape) + more, risk.reshape(shape)

    def _joined_costs(self, index: Indices) -> csr_array:
        """Sparse costs: rows are targets, columns sources, as trees grow from the target."""
        height, width = index.shape
        pairs = []
        for up, right in _STEPS:
            first_nodes = index[: height - up, max(0, -right) : width - max(0, right)]
            second_nodes = index[up:, max(0, right) : width + min(0, right)]
            both = (first_nodes >= 0) & (second_nodes >= 0)
            pairs.append(np.stack([first_nodes[both], second_nodes[both]]))
        a, b = np.concatenate(pairs, axis=1)
        there, back, safe = self.edge_cost(self.nodes_m[a], self.nodes_m[b])
        n = len(self.nodes_m)
        weight = np.concatenate([there[safe], back[safe]])
        ends = np.concatenate([b[safe], a[safe]]), np.concatenate([a[safe], b[safe]])
        return csr_array(coo_array((weight, ends), shape=(n, n)))


def _centred_grid(middle: float, extent: float, spacing: float) -> Floats:
    count = max(0, int(extent / spacing + 1e-9)) + 1 if extent >= 0.0 else 0
    return np.asarray(middle + (np.arange(count) - (count - 1) / 2) * spacing)


@compiled(
    f"void({readonly_array(dimensions=3, layout='C')}, UniTuple(float64, 3), UniTuple(float64, 4),"
    f" UniTuple(float64, 6), {readonly_array(dimensions=2, layout='C')},"
    f" {readonly_array(dimensions=2, layout='C')}, float64[::1], float64[::1], float64[::1])"
)
def _weigh(
    layers: Floats,
    grid: tuple[float, float, float],
    within: tuple[float, float, float, float],
    weights: tuple[float, float, float, float, float, float],
    points: Floats,
    direction: Floats,
    there: Floats,
    back: Floats,
    risk: Floats,
) -> None:
    """Write the cost of a metre at each point, of one in reverse, and the risk.

    One pass without temporary arrays: a world has some hundred thousand edge points.

    Args:
        layers: (rows, columns, 8) risk, variance, and those of the footprint.
        grid: corner and spacing.
        within: smallest x and y, then largest, from the corner; the risk is infinite beyond.
        weights: of variance, length, nearness, slope across and along, and the climb limit.
        points: (n, 2)
        direction: (n, 2) unit vectors.
        there: (n,) out.
        back: (n,) out.
        risk: (n,) out.

    """
    x0, y0, spacing = grid
    west, south, east, north = within
    uneven, level_m, near_m, side_m, climb_m, limit = weights
    field = np.empty(layers.shape[2])
    for k in range(len(points)):
        x, y, dx, dy = points[k, 0] - x0, points[k, 1] - y0, direction[k, 0], direction[k, 1]
        write_bilinear(layers, x / spacing, y / spacing, field)
        up = (field[2] * dx + field[3] * dy) / limit
        across = field[4] * dy * dy - 2.0 * field[5] * dx * dy + field[6] * dx * dx
        side = max(across, 0.0) / (limit * limit)
        level = uneven * field[1] + level_m + near_m * field[7] + side_m * side * side
        there[k] = level + climb_m * max(up, 0.0) ** 4
        back[k] = level + climb_m * max(-up, 0.0) ** 4
        outside = x < west or x > east or y < south or y > north
        risk[k] = np.inf if outside else field[0]
