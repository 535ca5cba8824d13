"""The path planner: a smooth path over safe ground through waypoints ([PT] 2.6.1, [KP] 4.3)."""

from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.bends import widen_in_steps
from snakewalk.controller.terrain.dubins import PathTurns
from snakewalk.controller.terrain.exact_route import exact_route
from snakewalk.controller.terrain.in_steps import Steps, at_once
from snakewalk.controller.terrain.keep_off import KeepOff
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.relief import Relief
from snakewalk.controller.terrain.rounded import rounded
from snakewalk.controller.terrain.route_advice import route_advice
from snakewalk.controller.terrain.safe_graph import SAMPLE_M, SafeGraph
from snakewalk.controller.terrain.waypoint_turns import WaypointTurns

_TABLE_STEP_M = 0.01
"""Step of a path's table: a path passes a waypoint within this distance of the point before it."""
_CHECK_STEP_M = 0.02  # spacing of the safety check of a spline
_UNSAFE = 30.0  # cost of a metre of unsafe ground in a turn, as metres of level path
_TURN_RADIUS_M = 0.5  # smallest turning radius of the body
_ROUNDS = 7  # halvings: the last pieces have a hundredth of a side's length


class TerrainPlanner:
    """Plans paths on one ground; on a flat floor, plain splines through the points.

    Fields and graph are built once. The first point of a call is the position of the head, safe or
    not.
    """

    def __init__(
        self,
        ground: HeightField | None,
        config: PlannerConfig,
        *,
        exact: bool = True,
        keep_off: KeepOff | None = None,
    ) -> None:
        """Build fields and graph.

        Args:
            ground: None for a flat floor.
            config: limits of safe ground.
            exact: search all safe ground if the graph's nodes give no smooth path; else reject such
                points, which is faster.
            keep_off: obstacle on the ground.

        """
        self._exact = exact
        self.relief = None if ground is None else Relief(ground, config, keep_off=keep_off)
        self.graph = None if self.relief is None else SafeGraph(self.relief)
        self._least_per_m = 1.0 if self.graph is None else self.graph.length_weight
        self._waypoint_turns = WaypointTurns(
            self._turn_cost_per_m, self._least_per_m, self._all_safe, config.bend_radius_m
        )
        scipy.interpolate.CubicSpline  # noqa: B018 - loads before a control cycle needs it
        self._numbers = [0]
        """Number of each point of a call, for messages; 0 is the start."""
        self._planned: tuple[Floats, SplinePath] | None = None
        """Points and path of the last plan that began in any direction."""

    def in_steps(
        self,
        points_m: ArrayLike,
        heading_rad: float | None = None,
        avoid_m: ArrayLike = (),
        number: int = 1,
    ) -> Steps[SplinePath]:
        """Plan a path from the head's position through (n, 2) waypoints, in steps.

        From an unsafe start the path leads straight to the nearest safe node. With a heading, the
        path begins in that direction and turns onto the planned one by a Dubins curve before the
        first waypoint, over safe ground if possible.

        Args:
            points_m: the first is the position of the head.
            heading_rad: direction of the body there; None for any.
            avoid_m: (k, 2) places where the body could not continue; paths avoid them by a
                footprint if possible.
            number: number of the first waypoint, for messages.

        Raises:
            InputError: a waypoint is off the world, on unsafe ground, or unreachable, or all are
                within a centimetre of the first point.

        """
        points = np.asarray(points_m, float)
        avoid = np.asarray(avoid_m, float).reshape(-1, 2)
        kept = _distinct_points(points)
        self._numbers = [number - 1 + k for k in kept]
        if len(kept) < 2:
            raise InputError(
                f"waypoints_m: no waypoint leads farther than {_TABLE_STEP_M * 100:g} cm from "
                f"{self._name(0, points[0])}; move or add one"
            )
        points = points[kept]
        if heading_rad is None:
            base = yield from self._base(points, avoid)
            path = yield from self._waypoint_turns.in_steps(base, points[1:], any_start=True)
            self._planned = points, path
            return path
        path = yield from self._path_from_elsewhere(points, avoid)
        yield 300
        until_m = path.first_pass(points[1])
        turns = PathTurns(
            path, heading_rad, _TURN_RADIUS_M, until_m, self._turn_cost_per_m, self._least_per_m
        )
        turn = yield from turns.cheapest_in_steps()
        yield 300
        return turns.onto(turn)

    def _base(self, points: Floats, avoid: Floats) -> Steps[SplinePath]:
        yield 700
        if self.relief is None or self.graph is None:
            return SplinePath(points)
        graph = yield from self.graph.avoiding_in_steps(avoid)
        faults = [f for k in range(1, len(points)) for f in self._fault(k, points[k])]
        if faults:
            raise InputError(faults)
        return (yield from self._path_through(points, graph, self.relief))

    def _path_through(self, points: Floats, graph: SafeGraph, relief: Relief) -> Steps[SplinePath]:
        """Path through safe points: by the graph's nodes, or else by all safe ground."""
        try:
            corners = yield from self._polygon(points, graph)
            return (yield from self._spline(corners, points, relief))
        except InputError as error:
            if not self._exact:
                raise
            fault = error
        legs = []
        for k in range(1, len(points)):
            leg = yield from exact_route(relief, graph, points[k - 1], points[k])
            if leg is None:
                raise self._no_route(k, points)
            legs.append(leg)
        for shorten in (True, False):
            corners = points[:1]
            for leg in legs:
                shown = (yield from _shortened_path(leg, graph)) if shorten else leg
                corners = np.vstack([corners, shown[1:]])
            free = ~(corners[:, None] == points[None]).all(axis=-1).any(axis=1)
            path = yield from rounded(corners, free, lambda places: relief.safe(*places.T))
            yield 500
            if not len(self._unsafe(path, points[0], relief)):
                return path
        raise fault

    def _path_from_elsewhere(self, points: Floats, avoid: Floats) -> Steps[SplinePath]:
        """Path from elsewhere: a new leg to the next waypoint, then the previous plan.

        A moving body has no time for more: turns by waypoints need some 30 ms each.
        """
        yield 500
        onward = self._onward(points, avoid)
        if onward is None:
            base = yield from self._base(points, avoid)
            return (yield from self._waypoint_turns.in_steps(base, points[1:], any_start=False))
        leg = yield from self._base(points[:2], avoid)
        path = yield from self._waypoint_turns.arrive_in_steps(leg, onward)
        return (yield from self._base(points, avoid)) if path is None else path

    def _onward(self, points: Floats, avoid: Floats) -> Floats | None:
        """(n, 2) points, a centimetre apart, of the previous plan after the second point.

        None if it has other waypoints, ends there, or passes a place to avoid.
        """
        if self._planned is None or len(points) < 3:
            return None
        planned, path = self._planned
        if not np.array_equal(planned[1 - len(points) :], points[1:]):
            return None
        until_next = planned[1 : len(planned) - len(points) + 2]
        passes = path.passes(until_next) or [0.0]  # the plan may have started at that point
        if path.length_m - passes[-1] < _TABLE_STEP_M:
            return None
        onward = path.piece_m(passes[-1], path.length_m)
        if self.relief is not None and len(avoid):
            gap = np.hypot(*(onward[:, None] - avoid[None]).T)
            if gap.min() < self.relief.config.footprint_m:
                return None
        return onward

    def plan(self, points_m: ArrayLike) -> SplinePath:
        """Plan in one piece, but reject a start that is off the world or unsafe.

        Raises:
            InputError: as for steps, and for the first point; with advice if a limit is too low.

        """
        points = np.asarray(points_m, float)
        self._numbers = list(range(len(points)))
        faults = [f for k in range(len(points)) for f in self._fault(k, points[k])]
        if not faults:
            try:
                return at_once(self.in_steps(points))
            except _NoRouteError as error:
                faults = [str(error)]
        assert self.relief is not None
        raise InputError([*faults, f"to use these points: {route_advice(self.relief, points)}"])

    def _turn_cost_per_m(self, points_m: Floats) -> Floats:
        """Cost (..., k) of a metre of path at (..., k, 2), with a penalty on unsafe ground."""
        if self.relief is None or self.graph is None:
            return np.ones(points_m.shape[:-1])
        unsafe = ~self.relief.safe(*np.moveaxis(points_m, -1, 0))
        return self.graph.cost_per_m(points_m) + _UNSAFE * self.graph.length_weight * unsafe

    def _all_safe(self, points_m: Floats) -> bool:
        return self.relief is None or bool(self.relief.safe(*points_m.T).all())

    def _polygon(self, points: Floats, graph: SafeGraph) -> Steps[Floats]:
        """(k, 2) corners through all points, leg by leg."""
        anchors = []
        for point in points:
            yield 100
            anchors.append(graph.nearest(point))
        pieces = [points[:1]]
        for k in range(1, len(points)):
            nearest, there = anchors[k - 1], anchors[k]
            if there is not None:
                yield from graph.tree_in_steps(there)
            yield 300
            if k == 1 and there is not None:  # the nearest node may be on an island of safe nodes
                nearest = graph.nearest(points[0], graph.can_reach(there))
            nodes = (
                None if nearest is None or there is None else graph.cheapest_path(nearest, there)
            )
            if nodes is None:
                raise self._no_route(k, points)
            nodes = np.vstack([points[k - 1], nodes, points[k]])
            corners = yield from straighten_in_steps(nodes, graph)
            pieces.append(corners[1:])
        return np.vstack(pieces)

    def _spline(self, corners: Floats, points: Floats, relief: Relief) -> Steps[SplinePath]:
        """Spline through the corners; add corners where it would leave safe ground.

        A cubic overshoots its polygon. The polygon is safe, and enough points hold the cubic to it.
        Bends are widened last, as far as that is safe.
        """
        for _ in range(_ROUNDS):
            yield 500
            path = SplinePath(corners)
            yield 500
            bad = self._unsafe(path, points[0], relief)
            if not len(bad):
                free = ~(corners[:, None] == points[None]).all(axis=-1).any(axis=1)
                return (
                    yield from widen_in_steps(
                        corners,
                        free,
                        relief.config.bend_radius_m,
                        lambda wider: not len(self._unsafe(wider, points[0], relief)),
                    )
                )
            corners = _denser(corners, path, bad)
        points = path.position(bad)
        worst = points[int(np.argmax(relief.risk(*points.T)))]
        x, y = (round(float(coordinate), 2) + 0.0 for coordinate in worst)  # avoids -0.00
        raise InputError(
            f"path: no smooth way over safe ground: ({x:.2f}, {y:.2f}) "
            f"{_unsafe_because(relief, worst)}; move a waypoint"
        )

    def _unsafe(self, path: SplinePath, start: Floats, relief: Relief) -> Floats:
        s = np.linspace(0.0, path.length_m, max(2, int(path.length_m / _CHECK_STEP_M) + 1))
        safe = relief.safe(*path.position(s).T)
        if not relief.safe(*start):
            safe[: int(np.argmax(safe))] = True
        return s[~safe]

    def _no_route(self, k: int, points: Floats) -> "_NoRouteError":
        assert self.relief is not None
        config = self.relief.config
        return _NoRouteError(
            f"{self._name(k, points[k])} cannot be reached from "
            f"{self._name(k - 1, points[k - 1])}: no way "
            f"stays under a slope of {np.degrees(config.slope_limit_rad):.1f} deg and an elevation "
            f"variance of {config.variance_limit_m2:.2g} m2"
        )

    def _fault(self, k: int, point: Floats) -> list[str]:
        """Return the fault of the k-th point; 0 is the start."""
        relief = self.relief
        graph = self.graph
        if relief is None or graph is None or relief.safe(*point):
            return []
        node = graph.nearest(point)
        if node is None:
            return [f"{self._name(k, point)}: this world has no safe ground at all"]
        x, y = graph.nodes_m[node]
        why = _unsafe_because(relief, point)
        return [f"{self._name(k, point)} {why}; the nearest safe point is ({x:.2f}, {y:.2f})"]

    def _name(self, k: int, point: Floats) -> str:
        """Name of the k-th point; 0 is the start, or the position of the head."""
        where = f"({point[0]:.2f}, {point[1]:.2f})"
        if k == 0:
            return f"start {where}" if self._numbers[0] == 0 else where
        return f"waypoint {self._numbers[k]} {where}"


class _NoRouteError(InputError):
    """No safe ground joins two points; a search for advice needs more time than a cycle has."""


def _distinct_points(points: Floats) -> list[int]:
    """Indices of points (n, 2) that are apart: of close ones the first, or the end of the path."""
    kept = [0]
    last = len(points) - 1
    for k in range(1, last + 1):
        while k == last and len(kept) > 1 and _points_are_close(points, kept[-1], k):
            kept.pop()
        if not _points_are_close(points, kept[-1], k):
            kept.append(k)
    return kept


def _points_are_close(points: Floats, j: int, k: int) -> bool:
    return bool(np.hypot(*(points[k] - points[j])) < _TABLE_STEP_M)


def _denser(points: Floats, path: SplinePath, bad_s_m: Floats) -> Floats:
    """Halve the sides of the polygon at unsafe places of the spline, and their neighbours."""
    nearest = 0.0
    ends = [0.0]
    for before, point in pairwise(points):
        nearest = path.nearest(
            point, nearest, window_m=2.0 * float(np.hypot(*(point - before))) + 0.1
        )
        ends.append(nearest)
    worst = np.searchsorted(ends, bad_s_m) - 1
    split = {int(piece) + step for piece in worst for step in (-1, 0, 1)}
    out = [points[0]]
    for piece, (before, point) in enumerate(pairwise(points)):
        if piece in split:
            out.append((before + point) / 2)
        out.append(point)
    return np.array(out)


def _unsafe_because(relief: Relief, point: Floats) -> str:
    if not relief.ground.contains(*point):
        w, h = relief.ground.size_m
        return f"is outside the world, {w:.1f} m by {h:.1f} m around (0, 0)"
    if not relief.within(*point):
        return f"is within {relief.config.edge_margin_m:g} m of the world's border"
    if not relief.known(*point):
        reach = relief.config.slope_window_m
        return f"is within {reach:g} m of ground that the world's map does not know"
    if relief.is_obstructed(*point):
        return "is in the world's obstacle, or nearer to it than the radius of the body"
    slope = np.degrees(float(relief.slope_rad(*point)))
    variance = float(relief.variance_m2(*point))
    most = relief.config.variance_limit_m2
    limit = np.degrees(relief.config.slope_limit_rad)
    return (
        f"is on unsafe ground: slope {slope:.1f} deg (limit {limit:.1f}), elevation variance "
        f"{variance:.2g} m2 (limit {most:.2g})"
    )


_REACH = 14  # largest number of nodes that a straight piece may skip, besides the whole leg
_SAMPLES_IN_STEP = 6000
_CORNER_M = 1.0  # cost of a corner, as metres of path: few corners make wide bends


def _shortened_path(corners_m: Floats, graph: SafeGraph) -> Steps[Floats]:
    while len(shorter := (yield from straighten_in_steps(corners_m, graph))) < len(corners_m):
        corners_m = shorter
    return corners_m


def straighten_in_steps(nodes_m: Floats, graph: SafeGraph) -> Steps[Floats]:
    """(k, 2) corners of the cheapest safe polygon from the first to the last of (m, 2) points.

    Consecutive points count as joined; any other piece must be safe along its length.
    """
    last = len(nodes_m) - 1
    b = np.repeat(np.arange(1, last + 1), _REACH)
    a = b - np.tile(np.arange(_REACH, 0, -1), last)
    a, b = a[a >= 0], b[a >= 0]
    if last > _REACH:
        a, b = np.append(a, 0), np.append(b, last)
    yield 300
    longest_m = float(np.hypot(*(nodes_m[b] - nodes_m[a]).T).max())
    samples = 1 + longest_m / SAMPLE_M
    costs = list[Floats]()
    safes = list[Bools]()
    for k in range(0, len(a), pairs_in_step := max(1, int(_SAMPLES_IN_STEP / samples))):
        yield 1000
        some = slice(k, k + pairs_in_step)
        part, _, is_safe = graph.edge_cost(nodes_m[a[some]], nodes_m[b[some]], longest_m)
        costs.append(part)
        safes.append(is_safe)
    cost = np.concatenate(costs)
    safe = np.concatenate(safes)
    yield 200 + len(a) // 4
    cost = np.where(safe | (b - a == 1), cost, np.inf) + _CORNER_M * graph.length_weight
    best = np.full(last + 1, np.inf)
    back = np.zeros(last + 1, dtype=int)
    best[0] = 0.0
    for i, j, weight in zip(a.tolist(), b.tolist(), cost.tolist(), strict=True):
        if best[i] + weight < best[j]:
            best[j], back[j] = best[i] + weight, i
    corners = [last]
    while corners[-1] != 0:
        corners.append(int(back[corners[-1]]))
    return nodes_m[corners[::-1]]
