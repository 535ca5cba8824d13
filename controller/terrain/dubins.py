"""Dubins curves: the shortest curves between two poses with bounded curvature.

L. E. Dubins, On curves of minimal length with a constraint on average curvature, and with
prescribed initial and terminal positions and tangents, American Journal of Mathematics 79, 1957.
The shortest curve is two arcs and a line between them, or three arcs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.terrain.in_steps import Steps, at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.drivers.compiling import compiled

_TURNS = np.array(
    [(a, 0, b) for a in (1, -1) for b in (1, -1)] + [(a, -a, a) for a in (1, -1)] * 2, float
)
"""(8, 3) turns of the pieces, 1 to the left; three arcs twice, as two middle circles fit."""
_FULL_TURN_TOLERANCE_RAD = 1e-9  # rounding must not make a full circle of an arc of length 0
_STEP_M = 0.01
_JOINS = 16
_SAMPLES = 24
_BATCH = 48
_LAID_POSES = 16
"""Poses to which curves are laid in a step."""


@dataclass(frozen=True, slots=True)
class DubinsCurves:
    """All Dubins curves from one pose to each of n others."""

    start_m: complex
    """Start of the curve as the complex number x + iy."""
    headings_rad: Floats
    """(n,) at the start."""
    radius_m: float
    pieces_m: Floats
    """(n, 8, 3) lengths of the pieces; infinite if the curve does not exist."""

    @property
    def length_m(self) -> Floats:
        """(n, 8) lengths of the curves."""
        return np.asarray(self.pieces_m.sum(axis=-1))

    def position(self, goal: int, kind: int, s_m: ArrayLike) -> Floats:
        """(n, 2) points of one curve at arc lengths (n,)."""
        s = np.atleast_2d(np.asarray(s_m, float))
        return np.asarray(self._positions(np.array([goal * len(_TURNS) + kind]), s)[0])

    def samples(self, which: Ints, count: int) -> Floats:
        """(k, count, 2) evenly spaced points of curves, both ends included.

        Args:
            which: (k,) flat indices into the (n, 8) curves; these must exist.
            count: points per curve.

        """
        length_m = self.pieces_m.reshape(-1, 3)[which].sum(axis=-1)
        return self._positions(which, length_m[:, None] * np.linspace(0.0, 1.0, count))

    def _positions(self, which: Ints, s_m: Floats) -> Floats:
        """(k, c, 2) points of curves (k,) at arc lengths (k, c)."""
        goal, kind = np.divmod(which, len(_TURNS))
        points = np.empty((*s_m.shape, 2))
        start = np.empty((len(which), 3))
        start[:, 0], start[:, 1] = self.start_m.real, self.start_m.imag
        start[:, 2] = self.headings_rad[goal]
        pieces = self.pieces_m.reshape(-1, 3)[which]
        _draw(start, pieces, _TURNS[kind] / self.radius_m, s_m, points)
        return points


@compiled(
    "void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, :, ::1])"
)
def _draw(start: Floats, pieces_m: Floats, bend_1_m: Floats, s_m: Floats, points: Floats) -> None:
    """Write points (k, c, 2) at arc lengths (k, c) of curves from poses (k, 3).

    The pieces (k, 3) have curvatures ``bend_1_m`` (k, 3), 1/m.
    """
    for k in range(len(s_m)):
        for i in range(s_m.shape[1]):
            x = start[k, 0]
            y = start[k, 1]
            heading = start[k, 2]
            left_m = s_m[k, i]
            for piece in range(3):
                length = min(left_m, pieces_m[k, piece])
                left_m -= length
                half = 0.5 * bend_1_m[k, piece] * length
                # chord of an arc: sin(half) / half times its length, at half the turn
                chord = length * np.sin(half) / half if half != 0.0 else length
                x += chord * np.cos(heading + half)
                y += chord * np.sin(heading + half)
                heading += 2.0 * half
            points[k, i, 0], points[k, i, 1] = x, y


def dubins_curves(
    start_m: ArrayLike,
    heading_rad: ArrayLike,
    goals_m: ArrayLike,
    goal_headings_rad: ArrayLike,
    radius_m: float,
) -> DubinsCurves:
    """Return all curves from a pose to goals (n, 2) with headings (n,).

    The start has one heading, or one for each goal (n,). The tangent of two circles gives arc,
    line, arc; a third circle of the same radius that touches both gives three arcs.
    """
    z0, z1 = complex(*np.asarray(start_m, float)), np.asarray(goals_m, float) @ [1.0, 1.0j]
    h1 = np.asarray(goal_headings_rad, float)
    h0 = np.broadcast_to(np.asarray(heading_rad, float), h1.shape)
    pieces = np.full((len(z1), len(_TURNS), 3), np.inf)
    for kind, (first, middle, last) in enumerate(_TURNS):
        c0 = z0 + 1j * first * radius_m * np.exp(1j * h0)
        c1 = z1 + 1j * last * radius_m * np.exp(1j * h1)
        gap_m = np.abs(c1 - c0)
        towards = np.angle(c1 - c0)
        if middle == 0.0:
            aside = (first - last) * radius_m
            there = gap_m >= abs(aside)
            between = np.sqrt(np.maximum(gap_m**2 - aside**2, 0.0))
            leave = meet = towards + np.arctan2(aside, between)
        else:
            there = gap_m <= 4.0 * radius_m
            side = 1.0 if kind < len(_TURNS) - 2 else -1.0
            off = side * np.arccos(np.minimum(gap_m / (4.0 * radius_m), 1.0))
            leave = towards + off + first * np.pi / 2.0
            meet = towards + np.pi - off + first * np.pi / 2.0
            between = radius_m * _turn(middle * (meet - leave))
        arcs = radius_m * _turn(first * (leave - h0)), between, radius_m * _turn(last * (h1 - meet))
        pieces[there, kind] = np.stack(arcs, axis=-1)[there]
    return DubinsCurves(z0, h0, radius_m, pieces)


@dataclass(frozen=True, slots=True)
class Turn:
    """A Dubins curve from the start of a path onto it."""

    points_m: Floats
    """(n, 2) a centimetre apart, from the start to where it joins the path."""
    joins_at_m: float
    """Arc length of the path where the curve joins it."""
    cost: float
    """Cost of the turn and the rest of the path."""


class PathTurns:
    """All turns from the start of a path onto it, in several directions."""

    def __init__(
        self,
        path: SplinePath,
        headings_rad: ArrayLike,
        radius_m: float,
        until_m: float,
        cost_per_m: Callable[[Floats], Floats],
        least_per_m: float,
        joins: int = _JOINS,
    ) -> None:
        """Choose ``joins`` places on the path, up to ``until_m``.

        Args:
            path: the curves begin at its start.
            headings_rad: (h,) directions of the body at the start.
            radius_m: smallest turning radius of the body.
            until_m: arc length on the path, for example of the first waypoint.
            cost_per_m: cost (..., k) at points (..., k, 2) along curves.
            least_per_m: lower bound of the cost per metre; excludes long curves.
            joins: number of places.

        """
        self.path = path
        self._cost_per_m = cost_per_m
        self._least_per_m = least_per_m
        self._headings_rad = np.atleast_1d(np.asarray(headings_rad, float))
        self._radius_m = radius_m
        self._s_m = np.linspace(0.0, until_m, joins)
        self._curves: DubinsCurves | None = None
        self._length_m = self._rest = self._bound = np.empty(0)
        self.least = np.empty(0)
        """(h,) lower bound of the cost of a turn in each direction; empty before the first turn."""

    def lay_in_steps(self) -> Steps[DubinsCurves]:
        """Compute all Dubins curves, once."""
        if self._curves is not None:
            return self._curves
        headings = self._headings_rad
        s_m = self._s_m
        path = self.path
        yield 100
        joins = len(s_m)
        times = len(headings)
        at_m = path.position(s_m)
        ahead = path.position(s_m + _STEP_M) - path.position(s_m - _STEP_M)
        direction = np.tile(np.arctan2(ahead[:, 1], ahead[:, 0]), times)
        starts = np.repeat(headings, joins)
        goals = np.tile(at_m, (times, 1))
        pieces = []
        for k in range(0, len(starts), _LAID_POSES):
            yield 700
            some = slice(k, k + _LAID_POSES)
            laid = dubins_curves(
                at_m[0], starts[some], goals[some], direction[some], self._radius_m
            )
            pieces.append(laid.pieces_m)
        yield 500
        self._curves = curves = DubinsCurves(
            complex(*at_m[0]), starts, self._radius_m, np.concatenate(pieces)
        )
        per_m = self._cost_per_m(at_m)
        spent = np.concatenate([[0.0], np.cumsum(np.diff(s_m) * (per_m[1:] + per_m[:-1]) / 2.0)])
        self._length_m = curves.length_m.ravel()
        self._rest = np.tile(np.repeat(spent[-1] - spent, len(_TURNS)), times)
        self._bound = self._least_per_m * self._length_m + self._rest
        self.least = self._bound.reshape(times, -1).min(axis=1)
        return curves

    def cheapest(self, direction: int = 0) -> Turn:
        """Return the turn in one direction with the lowest cost up to ``until_m``."""
        return at_once(self.cheapest_in_steps(direction))

    def cheapest_in_steps(self, direction: int = 0) -> Steps[Turn]:
        """Return ``cheapest`` in steps."""
        curves = yield from self.lay_in_steps()
        count = len(self._s_m) * len(_TURNS)
        first = direction * count
        yield 100
        order = first + np.argsort(self._bound[first : first + count])
        best = np.inf
        chosen = int(order[0])
        for some in np.split(order, range(_BATCH, count, _BATCH)):
            if self._bound[some[0]] >= best:
                break
            yield 800
            exist = some[np.isfinite(self._bound[some])]
            cost = self._cost_per_m(curves.samples(exist, _SAMPLES)).mean(axis=-1)
            cost = cost * self._length_m[exist] + self._rest[exist]
            k = int(np.argmin(cost))
            if cost[k] < best:
                best = float(cost[k])
                chosen = int(exist[k])
        goal, kind = divmod(chosen, len(_TURNS))
        turn_m = self._length_m[chosen]
        turned_m = np.linspace(0.0, turn_m, max(2, round(turn_m / _STEP_M)))
        join_m = float(self._s_m[goal % len(self._s_m)])
        return Turn(curves.position(goal, kind, turned_m), join_m, best)

    def onto(self, turn: Turn) -> SplinePath:
        """Return the path that begins with a turn."""
        after = np.arange(turn.joins_at_m + _STEP_M, self.path.length_m + _STEP_M, _STEP_M)
        return SplinePath.tabulated(np.vstack([turn.points_m, self.path.position(after)]))


def _turn(angle_rad: Floats) -> Floats:
    turn = np.mod(angle_rad, 2.0 * np.pi)
    return np.where(turn > 2.0 * np.pi - _FULL_TURN_TOLERANCE_RAD, 0.0, turn)
