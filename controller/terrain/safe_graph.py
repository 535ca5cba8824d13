"""The graph of safe nodes, and the cheapest paths through it ([PT] 2.6.1, [KP] 4.3)."""

from copy import copy
from typing import Self

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.controller.terrain.footprint import Footprint
from snakewalk.controller.terrain.relief import Relief

# A tenth is kept back for the nodes and edges: the spline may leave the polygon by a little.
RISK_LIMIT = 0.9

# Half of the sixteen neighbours; the other half are the same edges in the other direction.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (2, -1), (1, -2))
_SAMPLE_M = 0.05
_AVOID = 30.0
"""Metres of level path that a metre through an avoided place costs more."""


class SafeGraph:
    """Safe nodes on a grid, joined to up to sixteen neighbours; built once, searched often.

    The printed weight of an edge, the variance of the elevation along it, is zero along every
    contour, also across the steepest slope, and grows with the square of an edge's length. Here a
    metre of an edge weighs the *windowed* variance per node spacing, and ``length_weight`` times

        1 + climb_weight (up / limit)^4 + side_weight (side / limit)^4
          + clearance_weight (1 - distance to ground that cannot be climbed / clearance)^2,

    where up along the edge and side across it are the footprint's slopes, as tangents, and so is
    the climb limit. Flat ground does not tie, and cutting an edge in two changes nothing. Slopes
    far below the limit cost little more than their variance, those over it much, in every
    direction: a limit of the climb alone would be kept by hairpins shorter than the body.
    """

    def __init__(self, relief: Relief) -> None:
        self._relief = relief
        self.footprint = Footprint(relief.ground, relief.config)
        """Slopes under the body, by which edges are weighed."""
        self.length_weight = relief.config.length_weight
        """Weight of a metre of path on level ground."""
        ground, config = relief.ground, relief.config
        w, h = (size - 2.0 * config.edge_margin_m for size in ground.size_m)
        x = _centred(ground.x0_m + ground.size_m[0] / 2, w, config.node_spacing_m)
        y = _centred(ground.y0_m + ground.size_m[1] / 2, h, config.node_spacing_m)
        xx, yy = np.meshgrid(x, y)
        safe = relief.risk(xx, yy) <= RISK_LIMIT
        index = np.where(safe, np.cumsum(safe).reshape(safe.shape) - 1, -1)
        self.nodes_m = np.stack([xx[safe], yy[safe]], axis=-1)
        """(n, 2) safe nodes."""
        self.safe_share = float(safe.mean()) if safe.size else 0.0
        """Safe nodes over all nodes inside the margin."""
        self._avoid_m = np.empty((0, 2))
        self._edges = self._joined(index)
        self._trees: dict[int, tuple[Floats, Indices]] = {}

    def avoiding(self, places_m: Floats) -> Self:
        """Return this graph with a cost on what lies within a footprint of places (k, 2)."""
        if len(places_m) == 0:
            return self
        found = copy(self)
        found._avoid_m, found._trees = np.asarray(places_m, float), {}
        edges = self._edges.tocoo()
        from_m, to_m = self.nodes_m[edges.col], self.nodes_m[edges.row]
        length = np.hypot(*(to_m - from_m).T)
        more = self.length_weight * length * found._avoided(0.5 * (from_m + to_m))
        found._edges = csr_array(
            coo_array((edges.data + more, (edges.row, edges.col)), shape=edges.shape)
        )
        return found

    def _avoided(self, points_m: Floats) -> Floats:
        """Metres (...) that a metre of path at points (..., 2) costs more for avoided places."""
        total = np.zeros(points_m.shape[:-1])
        for place in self._avoid_m:
            far = np.hypot(*np.moveaxis(points_m - place, -1, 0))
            total += _AVOID * np.maximum(1.0 - far / self._relief.config.footprint_m, 0.0) ** 2
        return total

    def nearest(self, point_m: Floats, among: Bools | None = None) -> int | None:
        """Return the safe node nearest to a point; None if there is none."""
        gap = np.hypot(*(self.nodes_m - point_m).T)
        if among is not None:
            gap = np.where(among, gap, np.inf)
        if not np.isfinite(gap).any():
            return None
        return int(np.argmin(gap))

    def can_reach(self, target: int) -> Bools:
        """(n,) nodes from which ``target`` can be reached."""
        return np.isfinite(self._tree(target)[0])

    def cheapest_path(self, start: int, target: int) -> Floats | None:
        """(m, 2) nodes of the cheapest path, both ends included; None if there is none."""
        score, towards = self._tree(target)
        if not np.isfinite(score[start]):
            return None
        at = [start]
        while at[-1] != target:
            at.append(int(towards[at[-1]]))
        return self.nodes_m[at]

    def edge_cost(self, from_m: Floats, to_m: Floats) -> tuple[Floats, Floats, Bools]:
        """Weights of straight pieces (k, 2) to (k, 2), of them back, and whether they are safe."""
        length = np.hypot(*(to_m - from_m).T)
        count = max(2, int(np.ceil(length.max(initial=0.0) / _SAMPLE_M)) + 1)
        part = np.linspace(0.0, 1.0, count)[:, None]
        at = from_m[:, None] + part * (to_m - from_m)[:, None]
        direction = (to_m - from_m) / np.maximum(length, 1e-12)[:, None]
        there, back = self._cost_per_m(at, direction[:, None])
        safe = (self._relief.risk(*np.moveaxis(at, -1, 0)) <= RISK_LIMIT).all(axis=-1)
        return length * there.mean(axis=-1), length * back.mean(axis=-1), np.asarray(safe)

    def cost_per_m(self, points_m: Floats) -> Floats:
        """Weight (..., k) of a metre of path at points (..., k, 2) along curves, safe or not."""
        step = np.gradient(points_m, axis=-2)
        length = np.hypot(step[..., 0], step[..., 1])
        return self._cost_per_m(points_m, step / np.maximum(length, 1e-12)[..., None])[0]

    def _cost_per_m(self, points_m: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Weight (...) of a metre along unit vectors (..., 2), and of one against them."""
        config = self._relief.config
        up, side = self.footprint.slopes(points_m, direction) / np.tan(config.climb_limit_rad)
        level = 1.0 + config.clearance_weight * self.footprint.nearness(points_m)
        level = level + config.side_weight * side**4 + self._avoided(points_m)
        variance = self._relief.variance_m2(*np.moveaxis(points_m, -1, 0)) / config.node_spacing_m
        there, back = (
            variance
            + config.length_weight * (level + config.climb_weight * np.maximum(climb, 0.0) ** 4)
            for climb in (up, -up)
        )
        return there, back

    def _tree(self, target: int) -> tuple[Floats, Indices]:
        """Score to ``target`` and the next node towards it, from every node.

        Cached: a path that is planned again has the same waypoints and another start.
        """
        if target not in self._trees:
            score, towards = dijkstra(
                self._edges, directed=True, indices=[target], return_predecessors=True
            )
            self._trees[target] = score[0], towards[0].astype(np.intp)
        return self._trees[target]

    def _joined(self, index: Indices) -> csr_array:
        """Weights of edges; row and column are target and source, as trees grow from the target."""
        height, width = index.shape
        pairs = []
        for up, right in _STEPS:
            here = index[: height - up, max(0, -right) : width - max(0, right)]
            beside = index[up:, max(0, right) : width + min(0, right)]
            both = (here >= 0) & (beside >= 0)
            pairs.append(np.stack([here[both], beside[both]]))
        a, b = np.concatenate(pairs, axis=1)
        there, back, safe = self.edge_cost(self.nodes_m[a], self.nodes_m[b])
        n = len(self.nodes_m)
        weight = np.concatenate([there[safe], back[safe]])
        ends = np.concatenate([b[safe], a[safe]]), np.concatenate([a[safe], b[safe]])
        return csr_array(coo_array((weight, ends), shape=(n, n)))


def _centred(middle: float, extent: float, spacing: float) -> Floats:
    count = max(0, int(extent / spacing + 1e-9)) + 1 if extent >= 0.0 else 0
    return np.asarray(middle + (np.arange(count) - (count - 1) / 2) * spacing)
