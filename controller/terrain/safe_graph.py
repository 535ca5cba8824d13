"""The graph of safe nodes, and the cheapest paths through it ([PT] 2.6.1, [KP] 4.3)."""

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.controller.terrain.relief import Relief

# A tenth is kept back for the nodes and edges: the spline may leave the polygon by a little.
RISK_LIMIT = 0.9

# Half of the sixteen neighbours; the other half are the same edges seen from the other end.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (2, -1), (1, -2))
_SAMPLE_M = 0.05


class SafeGraph:
    """Safe nodes on a grid, joined to up to sixteen neighbours; built once, searched often.

    The printed weight of an edge, the variance of the elevation along it, is zero along every
    contour, also across the steepest slope, and grows with the square of an edge's length. Here it
    is the mean *windowed* variance on the edge per node spacing, so that a side slope counts and
    cutting an edge in two changes nothing, plus ``length_weight`` times length, so that flat ground
    does not tie.
    """

    def __init__(self, relief: Relief) -> None:
        self._relief = relief
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
        self._edges = self._joined(index)
        self._trees: dict[int, tuple[Floats, Indices]] = {}

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

    def edge_cost(self, from_m: Floats, to_m: Floats) -> tuple[Floats, Bools]:
        """Weights of straight pieces (k, 2) to (k, 2), and whether each is safe all along."""
        length = np.hypot(*(to_m - from_m).T)
        count = max(2, int(np.ceil(length.max(initial=0.0) / _SAMPLE_M)) + 1)
        part = np.linspace(0.0, 1.0, count)[:, None]
        at = from_m[:, None] + part * (to_m - from_m)[:, None]
        safe = np.asarray((self._relief.risk(*np.moveaxis(at, -1, 0)) <= RISK_LIMIT).all(axis=-1))
        return length * self.cost_per_m(at).mean(axis=-1), safe

    def cost_per_m(self, points_m: Floats) -> Floats:
        """Weight (..., k) of a metre of path at points (..., k, 2) along curves, safe or not."""
        config = self._relief.config
        variance = self._relief.variance_m2(*np.moveaxis(points_m, -1, 0))
        return variance / config.node_spacing_m + config.length_weight

    def _tree(self, target: int) -> tuple[Floats, Indices]:
        """Score to ``target`` and the next node towards it, from every node.

        Cached: a path that is planned again has the same waypoints and another start.
        """
        if target not in self._trees:
            score, towards = dijkstra(
                self._edges, directed=False, indices=[target], return_predecessors=True
            )
            self._trees[target] = score[0], towards[0].astype(np.intp)
        return self._trees[target]

    def _joined(self, index: Indices) -> csr_array:
        rows, columns = index.shape
        pairs = []
        for up, right in _STEPS:
            here = index[: rows - up, max(0, -right) : columns - max(0, right)]
            there = index[up:, max(0, right) : columns + min(0, right)]
            both = (here >= 0) & (there >= 0)
            pairs.append(np.stack([here[both], there[both]]))
        a, b = np.concatenate(pairs, axis=1)
        weight, safe = self.edge_cost(self.nodes_m[a], self.nodes_m[b])
        n = len(self.nodes_m)
        return csr_array(coo_array((weight[safe], (a[safe], b[safe])), shape=(n, n)))


def _centred(middle: float, extent: float, spacing: float) -> Floats:
    count = max(0, int(extent / spacing + 1e-9)) + 1 if extent >= 0.0 else 0
    return np.asarray(middle + (np.arange(count) - (count - 1) / 2) * spacing)
