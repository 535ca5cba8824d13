"""Paths on a growing map: over known safe ground, as far as it leads towards the waypoints.

The plan to a waypoint beyond the map assumes that unknown ground is passable, at the cost of ground
next to a place that cannot be climbed. The body follows only the known and safe part of that plan.
(The free-space assumption: A. Stentz, The focussed D* algorithm for real-time replanning, IJCAI
1995.)
"""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.terrain.relief import Relief
from snakewalk.controller.terrain.safe_graph import SafeGraph

_REACH_M = 0.6
"""Longest distance from the head to the first node (ours): a mast's cameras do not see the ground
at its foot."""
_SHORTEST_PATH_M = 0.4
"""Shortest path worth walking, where there is a longer one (ours)."""
_PATH_DISTANCES_M = (np.inf, 1.2, 0.7)
"""Distances that a path may lead; the nearer ones where no smooth path leads farther (ours)."""
_SURELY_UNSAFE = 1.15
"""Largest risk of ground on a path in force: the next picture may show planned ground to be a
little worse."""
_TIES = 0.01
_UNSEEN = 1.5
"""Metres of level path that a straight metre is taken for where no path is found at all."""


class MapPlanner:
    """Plans as ``TerrainPlanner`` on the present map; without a map, plain splines."""

    def __init__(self, config: PlannerConfig) -> None:
        self._config = config
        self._on: _Knowledge | None = None

    def update(self, ground: HeightField) -> None:
        """Use this map from now on."""
        self._on = _Knowledge(ground, self._config)

    def in_steps(
        self,
        points_m: ArrayLike,
        heading_rad: float | None = None,
        *,
        avoid_m: ArrayLike = (),
        number: int = 1,
    ) -> Steps[SplinePath]:
        """Plan through (n, 2) points in order, as far as the map at the first step allows.

        Raises:
            InputError: no safe ground is known.

        """
        points = np.asarray(points_m, float)
        knowledge = self._on
        if knowledge is None:
            planner = TerrainPlanner(None, self._config)
            return (yield from planner.in_steps(points, heading_rad, avoid_m=avoid_m))
        faults: tuple[str, ...] = ()
        for within_m in _PATH_DISTANCES_M:
            yield 10000
            corners = knowledge.corners(points, within_m)
            plan = knowledge.cautious.in_steps(corners, heading_rad, avoid_m=avoid_m, number=number)
            try:
                return (yield from plan)
            except InputError as error:  # no smooth path: try a shorter one
                faults = error.faults
        raise InputError(faults)

    def clear(self, points_m: Floats) -> bool:
        """Whether the known ground does not forbid points (n, 2)."""
        return self._on is None or bool(
            (self._on.open_relief.risk(*points_m.T) <= _SURELY_UNSAFE).all()
        )

    def safe(self, point_m: Floats) -> bool:
        """Whether a point (2,) is known and safe."""
        if self._on is None or self._on.cautious.relief is None:
            return False
        return bool(self._on.cautious.relief.safe(*point_m))


class _Knowledge:
    """A map and its lazily built planners."""

    def __init__(self, ground: HeightField, config: PlannerConfig) -> None:
        self._ground = ground
        self._config = config

    @cached_property
    def cautious(self) -> TerrainPlanner:
        return TerrainPlanner(self._ground, self._config, exact=False)

    @cached_property
    def open_relief(self) -> Relief:
        return Relief(self._ground, self._config, unknown_risk=0.0)

    @cached_property
    def _open_graph(self) -> SafeGraph:
        return SafeGraph(self.open_relief)

    def corners(self, points: Floats, within_m: float) -> Floats:
        """(k, 2) the points that known safe ground joins, then the farthest node towards the next.

        Args:
            points: (n, 2); the first is the position of the head.
            within_m: distance from the head; farther ground counts as unknown.

        """
        graph = self.cautious.graph
        relief = self.cautious.relief
        if graph is None or relief is None or not len(graph.nodes_m):
            return points  # the planner reports this
        near = np.hypot(*(graph.nodes_m - points[0]).T) <= within_m
        reached = [points[0]]
        reach_m = _REACH_M
        for point in points[1:]:
            costs = np.where(near, graph.costs_from(reached[-1], reach_m), np.inf)
            node = graph.nearest(point)
            if node is None or not np.isfinite(costs[node]) or not relief.safe(*point):
                if np.isfinite(costs).any():
                    reached.append(self._farthest_safe_node(graph, costs, reached[-1], point))
                break
            reached.append(point)
            reach_m = 0.0
        return np.array(reached) if len(reached) > 1 else points

    def _farthest_safe_node(
        self, graph: SafeGraph, costs: Floats, start: Floats, goal: Floats
    ) -> Floats:
        """(2,) node at which the best path to a goal leaves known safe ground."""
        to_go = _UNSEEN * graph.length_weight * np.hypot(*(graph.nodes_m - goal).T)
        target = self._open_graph.nearest(goal)
        if target is not None:
            index = np.searchsorted(self._open_graph.place, graph.place)
            open_to_go = self._open_graph.costs_to(target)[index]
            if (np.isfinite(costs) & np.isfinite(open_to_go)).any():
                to_go = open_to_go
        # Along the best path all sums are equal; choose the farthest of its nodes.
        total_cost = (1.0 - _TIES) * costs + to_go
        far = np.hypot(*(graph.nodes_m - start).T) >= _SHORTEST_PATH_M
        if np.isfinite(total_cost[far]).any():
            total_cost = np.where(far, total_cost, np.inf)
        return np.asarray(graph.nodes_m[int(np.argmin(total_cost))])
