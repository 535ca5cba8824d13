"""Dubins curves: from one pose to another with bounded curvature; how a body joins a path.

L. E. Dubins, On curves of minimal length with a constraint on average curvature, and with
prescribed initial and terminal positions and tangents, American Journal of Mathematics 79, 1957:
the shortest curve is two arcs and a line between them, or three arcs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.terrain.path import SplinePath

_TURNS = np.array(
    [(a, 0, b) for a in (1, -1) for b in (1, -1)] + [(a, -a, a) for a in (1, -1)] * 2, float
)
"""(8, 3) turns of the pieces, 1 to the left; three arcs twice, as two middle circles fit."""
_FULL_TURN_TOLERANCE_RAD = 1e-9  # an arc of nothing is not a full circle by rounding
_STEP_M = 0.01
_JOINS = 16
_SAMPLES = 24
_BATCH = 48


@dataclass(frozen=True, slots=True)
class DubinsCurves:
    """All curves of Dubins' kinds from one pose to each of n others."""

    start_m: complex
    """x + iy."""
    heading_rad: float
    radius_m: float
    pieces_m: Floats
    """(n, 8, 3) lengths of the pieces; infinite where there is no such curve."""

    @property
    def length_m(self) -> Floats:
        """Lengths (n, 8) of the curves."""
        return np.asarray(self.pieces_m.sum(axis=-1))

    def position(self, goal: int, kind: int, s_m: ArrayLike) -> Floats:
        """(..., 2) points of one curve at arc lengths."""
        s = np.asarray(s_m, float)
        return self._positions(self.pieces_m[goal, kind], _TURNS[kind], s)

    def samples(self, which: Ints, count: int) -> Floats:
        """(k, count, 2) points evenly along curves, both ends included.

        Args:
            which: (k,) flat indices into the (n, 8) curves; these must exist.
            count: points a curve.

        """
        pieces = self.pieces_m.reshape(-1, 3)[which]
        s = pieces.sum(axis=-1)[:, None] * np.linspace(0.0, 1.0, count)
        return self._positions(pieces[:, None, :], _TURNS[which % len(_TURNS)][:, None, :], s)

    def _positions(self, pieces_m: Floats, turns: Floats, s_m: Floats) -> Floats:
        at = np.full(s_m.shape, self.start_m, complex)
        heading, begin = np.full(s_m.shape, self.heading_rad), np.zeros(s_m.shape)
        for k in range(3):
            length = np.clip(s_m - begin, 0.0, pieces_m[..., k])
            turn = turns[..., k] * length / self.radius_m
            # the chord of an arc: sin(turn / 2) over (turn / 2) of its length, half the turn on
            at = at + length * np.sinc(turn / (2.0 * np.pi)) * np.exp(1j * (heading + turn / 2.0))
            heading, begin = heading + turn, begin + pieces_m[..., k]
        return np.stack([at.real, at.imag], axis=-1)


def dubins_curves(
    start_m: ArrayLike,
    heading_rad: float,
    goals_m: ArrayLike,
    goal_headings_rad: ArrayLike,
    radius_m: float,
) -> DubinsCurves:
    """Return all curves from a pose to goals (n, 2) with headings (n,); the shortest is Dubins'.

    The tangent of two circles gives an arc, a line and an arc; a circle that touches both, of the
    same radius, gives three arcs.
    """
    z0, z1 = complex(*np.asarray(start_m, float)), np.asarray(goals_m, float) @ [1.0, 1.0j]
    h0, h1 = heading_rad, np.asarray(goal_headings_rad, float)
    pieces = np.full((len(z1), len(_TURNS), 3), np.inf)
    for kind, (first, middle, last) in enumerate(_TURNS):
        c0 = z0 + 1j * first * radius_m * np.exp(1j * h0)
        c1 = z1 + 1j * last * radius_m * np.exp(1j * h1)
        apart, towards = np.abs(c1 - c0), np.angle(c1 - c0)
        if middle == 0.0:
            aside = (first - last) * radius_m
            there = apart >= abs(aside)
            between = np.sqrt(np.maximum(apart**2 - aside**2, 0.0))
            leave = meet = towards + np.arctan2(aside, between)
        else:
            there = apart <= 4.0 * radius_m
            side = 1.0 if kind < len(_TURNS) - 2 else -1.0
            off = side * np.arccos(np.minimum(apart / (4.0 * radius_m), 1.0))
            leave = towards + off + first * np.pi / 2.0
            meet = towards + np.pi - off + first * np.pi / 2.0
            between = radius_m * _turn(middle * (meet - leave))
        arcs = radius_m * _turn(first * (leave - h0)), between, radius_m * _turn(last * (h1 - meet))
        pieces[there, kind] = np.stack(arcs, axis=-1)[there]
    return DubinsCurves(z0, heading_rad, radius_m, pieces)


def turn_onto(
    path: SplinePath,
    heading_rad: float,
    radius_m: float,
    until_m: float,
    cost_per_m: Callable[[Floats], Floats],
    least_per_m: float,
) -> SplinePath:
    """Return a path that begins with ``heading_rad`` and turns onto ``path`` by ``until_m``.

    Of all Dubins curves to places on the path up to there, the one is taken with which the way to
    ``until_m`` costs least.

    Args:
        path: its start is where the curve begins.
        heading_rad: direction of the body at the start.
        radius_m: least that the body can turn with.
        until_m: arc length on the path, for example of the first waypoint.
        cost_per_m: of points (..., k, 2) along curves, (..., k).
        least_per_m: what a metre costs at least: spares curves that are too long.

    """
    s_m = np.linspace(0.0, until_m, _JOINS)
    at_m = path.position(s_m)
    ahead = path.position(s_m + _STEP_M) - path.position(s_m - _STEP_M)
    headings = np.arctan2(ahead[:, 1], ahead[:, 0])
    curves = dubins_curves(at_m[0], heading_rad, at_m, headings, radius_m)
    length_m, per_m = curves.length_m, cost_per_m(at_m)
    spent = np.concatenate([[0.0], np.cumsum(np.diff(s_m) * (per_m[1:] + per_m[:-1]) / 2.0)])
    rest = np.repeat(spent[-1] - spent, len(_TURNS))
    bound = least_per_m * length_m.ravel() + rest
    order = np.argsort(bound)
    best, chosen = np.inf, int(order[0])
    for some in np.split(order, range(_BATCH, len(order), _BATCH)):
        if bound[some[0]] >= best:
            break
        exist = some[np.isfinite(bound[some])]
        cost = cost_per_m(curves.samples(exist, _SAMPLES)).mean(axis=-1)
        cost = cost * length_m.ravel()[exist] + rest[exist]
        k = int(np.argmin(cost))
        if cost[k] < best:
            best, chosen = float(cost[k]), int(exist[k])
    goal, kind = divmod(chosen, len(_TURNS))
    turn_m = length_m[goal, kind]
    turn = curves.position(goal, kind, np.linspace(0.0, turn_m, max(2, round(turn_m / _STEP_M))))
    after = np.arange(s_m[goal] + _STEP_M, path.length_m + _STEP_M, _STEP_M)
    return SplinePath.tabulated(np.vstack([turn, path.position(after)]))


def _turn(angle_rad: Floats) -> Floats:
    """Angle of an arc, from 0 to a full turn."""
    turn = np.mod(angle_rad, 2.0 * np.pi)
    return np.where(turn > 2.0 * np.pi - _FULL_TURN_TOLERANCE_RAD, 0.0, turn)
