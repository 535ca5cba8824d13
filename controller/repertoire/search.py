"""Search over sequences of actions through waypoints, on the repertoire alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.moves import SAMPLES, Moves

AIM_SHARE = 0.75
"""Of a waypoint's radius that is aimed at: the body does not end a cycle quite where predicted."""


@dataclass(frozen=True, slots=True)
class Route:
    """A sequence of actions and where it leads."""

    actions: tuple[int, ...]
    pose: Floats
    """(n + 1, 3) x, y and heading of the body frame before each action, and at the end."""
    reached: int
    """Waypoints passed within the radius."""
    duration_s: float
    candidates: int
    """Sequences that were scored; each took the prediction of one more cycle."""


def search(
    moves: Moves,
    start: ArrayLike,
    waypoints_m: Sequence[tuple[float, float]],
    radius_m: float,
    *,
    reached: int = 0,
    beam: int = 400,
    depth: int = 60,
) -> Route:
    """Beam search: the quickest sequence that passes within ``radius_m`` of all waypoints in order.

    Each round tries every action after each of the ``beam`` best sequences; one is worth the time
    that it has taken and a lower estimate of what is left: the way at the largest speed, and the
    turn towards the next waypoint.

    Returns:
        the quickest that reaches all, or the best of the last round if none does within ``depth``.

    """
    goals = np.asarray(waypoints_m, dtype=float).reshape(-1, 2)
    begin = np.asarray(start, dtype=float)[None]
    if reached >= len(goals):
        return Route((), begin, reached, 0.0, 0)
    after = np.append(np.cumsum(np.hypot(*np.diff(goals, axis=0).T)[::-1])[::-1], 0.0)
    level = _Level(
        begin, np.array([reached]), np.zeros(1), None, np.zeros(1, int), np.zeros(1, int)
    )
    best: tuple[_Level, int] | None = None
    candidates = 0
    for _ in range(depth):
        ends, count, spent = _tried(moves, level, goals, radius_m)
        candidates += len(ends)
        cost = spent + _left_s(moves, ends, count, goals, after, radius_m)
        order = np.argsort(cost, kind="stable")[:beam]
        parent, action = np.divmod(order, len(moves.duration_s))
        level = _Level(ends[order], count[order], spent[order], level, parent, action)
        done = level.passed >= len(goals)
        if done.any():
            first = int(np.argmin(np.where(done, level.time_s, np.inf)))
            if best is None or level.time_s[first] < best[0].time_s[best[1]]:
                best = level, first
        going = ~done
        if best is not None:
            going &= cost[order] < best[0].time_s[best[1]]
        if not going.any():
            break
        level = level.only(np.flatnonzero(going))
    return _traced(*(best or (level, 0)), candidates)


@dataclass(frozen=True, slots=True)
class _Level:
    """Sequences of one length, and the level that they go on from."""

    pose: Floats
    """(n, 3)"""
    passed: NDArray[np.int64]
    """(n,) waypoints."""
    time_s: Floats
    """(n,)"""
    before: "_Level | None"
    parent: NDArray[np.int64]
    """(n,) in ``before``."""
    action: NDArray[np.int64]
    """(n,) that led here."""

    def only(self, which: NDArray[np.int64]) -> "_Level":
        """Return some of them."""
        return _Level(
            self.pose[which], self.passed[which], self.time_s[which],
            self.before, self.parent[which], self.action[which],
        )  # fmt: skip


def _tried(
    moves: Moves, level: _Level, goals: Floats, radius_m: float
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Every action after each sequence: (nA, 3) poses, (nA,) waypoints passed, (nA,) time."""
    c, s = np.cos(level.pose[:, 2]), np.sin(level.pose[:, 2])
    x, y = moves.way[None, :, :, 0], moves.way[None, :, :, 1]
    at_x = level.pose[:, 0, None, None] + c[:, None, None] * x - s[:, None, None] * y
    at_y = level.pose[:, 1, None, None] + s[:, None, None] * x + c[:, None, None] * y
    count = np.repeat(level.passed[:, None], len(moves.duration_s), axis=1)
    for k in range(SAMPLES):  # in time: a cycle may pass two waypoints
        goal = goals[np.minimum(count, len(goals) - 1)]
        gap = np.hypot(at_x[:, :, k] - goal[:, :, 0], at_y[:, :, k] - goal[:, :, 1])
        count += (gap <= radius_m) & (count < len(goals))
    heading = level.pose[:, 2, None] + moves.way[None, :, -1, 2]
    ends = np.stack([at_x[:, :, -1], at_y[:, :, -1], heading], axis=2)
    spent = level.time_s[:, None] + moves.duration_s
    return ends.reshape(-1, 3), count.ravel(), spent.ravel()


def _traced(level: _Level, at: int, candidates: int) -> Route:
    """Follow a sequence back to its beginning."""
    reached, time_s = int(level.passed[at]), float(level.time_s[at])
    poses, actions = [level.pose[at]], []
    before: _Level | None = level
    while before is not None and before.before is not None:
        actions.append(int(before.action[at]))
        at = int(before.parent[at])
        before = before.before
        poses.append(before.pose[at])
    return Route(tuple(actions[::-1]), np.array(poses[::-1]), reached, time_s, candidates)


def _left_s(
    moves: Moves,
    pose: Floats,
    count: NDArray[np.int64],
    goals: Floats,
    after: Floats,
    radius_m: float,
) -> Floats:
    """(n,) estimate of the time that is left."""
    which = np.minimum(count, len(goals) - 1)
    to = goals[which] - pose[:, :2]
    way = np.hypot(to[:, 0], to[:, 1])
    off = np.arctan2(to[:, 1], to[:, 0]) - pose[:, 2] - moves.course_rad
    left = (np.maximum(way - radius_m, 0.0) + after[which]) / moves.speed_m_s
    return np.where(count >= len(goals), 0.0, left + 0.5 * np.abs(wrap(off)) / moves.turn_rad_s)
