"""Turns by waypoints: replace bends that are too sharp for a body by wider turns.

A path may turn back at a waypoint, or reach it past unsafe ground. Its spline then has a bend of a
few centimetres, and the body misses the waypoint.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.controller.terrain.bends import sharpest_bend
from snakewalk.controller.terrain.dubins import PathTurns, Turn
from snakewalk.controller.terrain.in_steps import Steps, at_once
from snakewalk.controller.terrain.path import SplinePath

_SHARP = 0.45
"""Share of the wanted radius (ours): larger bends are followed, at 0.2 m a corner of 90 degrees."""
_TURNED_BACK_RAD = 2.0
_SHARP_BACK = 0.75
"""Share of the wanted radius for a bend by which a path turns back, by at least this angle (ours):
3 of 10 walks missed a waypoint at 0.19 m and 128 degrees."""
_RADII = 1.5, 1.0, 0.75, 0.5
"""Shares of the wanted radius, tried in turn until a turn stays on safe ground. The centre of a
body of 1.2 m in an arc of 0.4 m lies 0.13 m inside of it, of 0.6 m 0.09 m."""
_ALL_ROUND_RAD = np.arange(16) * 2.0 * np.pi / 16
_STEP_M = 0.01
_NEAR_WAYPOINT_M = 0.5
"""Way before and after a waypoint in which a bend counts as being there."""
_SHORTEST_LEG_M = 0.02
"""Shortest leg: two steps, because the direction at its end needs two points after its first."""
_JOIN_M = 0.1
_JOINS = 16, 64


class WaypointTurns:
    """Replaces sharp bends near the waypoints of a path by Dubins curves."""

    def __init__(
        self,
        cost_per_m: Callable[[Floats], Floats],
        least_per_m: float,
        safe: Callable[[Floats], bool],
        radius_m: float,
    ) -> None:
        """Store the costs of ground.

        Args:
            cost_per_m: cost (..., k) at points (..., k, 2) along curves.
            least_per_m: lower bound of the cost per metre.
            safe: whether all points (n, 2) are on safe ground.
            radius_m: preferred radius of turns.

        """
        self._cost_per_m = cost_per_m
        self._least = least_per_m
        self._safe = safe
        self._radius_m = radius_m

    def __call__(self, path: SplinePath, waypoints_m: ArrayLike, *, any_start: bool) -> SplinePath:
        """Return the path with turns at sharp bends near its start or a waypoint.

        The body passes a waypoint in the direction with the lowest cost of both legs. A bend
        without a safe turn stays.

        Args:
            path: through the waypoints.
            waypoints_m: (n, 2) in order; the last is the path's end.
            any_start: whether the path may begin in another direction.

        """
        return at_once(self.in_steps(path, waypoints_m, any_start=any_start))

    def in_steps(
        self, path: SplinePath, waypoints_m: ArrayLike, *, any_start: bool
    ) -> Steps[SplinePath]:
        """Run a call in steps."""
        yield 500
        if path.length_m < _SHORTEST_LEG_M:
            return path
        legs = _legs(path, np.asarray(waypoints_m, float))
        turned = False
        for k in range(0 if any_start else 1, len(legs) + 1):
            yield 200
            if self._is_sharp(legs, k):
                to_m = legs[k - 1] if k > 0 else None
                from_m = legs[k] if k < len(legs) else None
                legs_now = yield from self._turning_legs(
                    to_m, from_m, _ALL_ROUND_RAD + np.pi, _ALL_ROUND_RAD
                )
                if legs_now is not None:
                    legs[max(k - 1, 0) : k + 1] = legs_now
                    turned = True
        if not turned:
            return path
        yield 200
        return SplinePath.tabulated(np.vstack([legs[0], *(leg[1:] for leg in legs[1:])]))

    def _is_sharp(self, legs: Sequence[Floats], k: int) -> bool:
        """Whether a body cannot follow the bend near the end of the k-th leg."""
        near_m = _points_near_m(legs, k)
        radius_m = sharpest_bend(SplinePath.tabulated(near_m))[0]
        turned_back = _turn_of_points_rad(near_m) > _TURNED_BACK_RAD
        return radius_m < (_SHARP_BACK if turned_back else _SHARP) * self._radius_m

    def arrive_in_steps(self, leg: SplinePath, onward_m: Floats) -> Steps[SplinePath | None]:
        """Join a leg to a waypoint and the points (n, 2) after it by a safe turn, or None."""
        back = np.arctan2(*(onward_m[0] - onward_m[1])[::-1])
        to_m = leg.piece_m(0.0, leg.length_m)
        backs = np.array([back])
        legs = yield from self._turning_legs(to_m, None, backs, backs - np.pi)
        return None if legs is None else SplinePath.tabulated(np.vstack([*legs, onward_m[1:]]))

    def _turning_legs(
        self, to_m: Floats | None, from_m: Floats | None, backs_rad: Floats, headings_rad: Floats
    ) -> Steps[list[Floats] | None]:
        """Legs (n, 2) to and from a waypoint with a turn there; None without a safe turn.

        The path leaves the waypoint in one of the directions ``headings_rad`` (h,), opposite to
        ``backs_rad`` (h,).
        """
        for share in _RADII:
            yield 200
            sides = []
            if to_m is not None:
                sides.append(self._turns(to_m[::-1], backs_rad, share, back=True))
            if from_m is not None:
                sides.append(self._turns(from_m, headings_rad, share, back=False))
            turns = yield from self._cheapest(sides)
            if turns:
                yield 400
                legs = [side.onto(turn) for side, turn in zip(sides, turns, strict=True)]
                points = [leg.piece_m(0.0, leg.length_m) for leg in legs]
                return points if to_m is None else [points[0][::-1], *points[1:]]
        return None

    def _turns(self, leg: Floats, headings: Floats, share: float, *, back: bool) -> PathTurns:
        """Turns from the waypoint onto a leg (n, 2); with ``back`` the leg is reversed."""
        path = SplinePath.tabulated(np.ascontiguousarray(leg))
        joins = int(np.clip(path.length_m / _JOIN_M, *_JOINS))
        cost = self._cost_backwards if back else self._cost_per_m
        radius_m = share * self._radius_m
        return PathTurns(path, headings, radius_m, path.length_m, cost, self._least, joins)

    def _cost_backwards(self, points_m: Floats) -> Floats:
        return self._cost_per_m(points_m[..., ::-1, :])[..., ::-1]

    def _cheapest(self, sides: list[PathTurns]) -> Steps[list[Turn]]:
        """Safe turns, one per side, in the direction with the lowest cost; empty without."""
        for side in sides:
            yield from side.lay_in_steps()
        least = np.sum([side.least for side in sides], axis=0)
        best = np.inf
        chosen = list[Turn]()
        for direction in np.argsort(least).tolist():
            if least[direction] >= best:
                break
            cost = float(least[direction])
            turns = list[Turn]()
            for side in sides:
                turn = yield from side.cheapest_in_steps(direction)
                cost += turn.cost - side.least[direction]
                if cost >= best or not self._safe(turn.points_m):
                    break
                turns.append(turn)
            else:
                best = cost
                chosen = turns
        return chosen


def _legs(path: SplinePath, waypoints_m: Floats) -> list[Floats]:
    """Points (n, 2) of the path's legs between waypoints; a short leg is a part of the next."""
    marks = [0.0]
    for at_m in path.passes(waypoints_m[:-1]):
        if min(at_m - marks[-1], path.length_m - at_m) >= _SHORTEST_LEG_M:
            marks.append(at_m)
    return [path.piece_m(begin, end) for begin, end in pairwise([*marks, path.length_m])]


def _points_near_m(legs: Sequence[Floats], k: int) -> Floats:
    """Points (n, 2) of a path near the end of the k-th leg."""
    near = round(_NEAR_WAYPOINT_M / _STEP_M)
    before = [leg[-near:] for leg in legs[max(k - 1, 0) : k]]
    after = [leg[1:near] for leg in legs[k : k + 1]]
    return np.vstack(before + after)


def _turn_of_points_rad(points_m: Floats) -> float:
    """Angle between the first and the last direction of points (n, 2)."""
    (ax, ay), (bx, by) = points_m[1] - points_m[0], points_m[-1] - points_m[-2]
    return abs(float(np.arctan2(ax * by - ay * bx, ax * bx + ay * by)))
