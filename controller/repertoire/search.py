"""Search over sequences of actions through waypoints, on the repertoire alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.drivers.attitude import about_up

AIM_SHARE = 0.75
"""Share of a waypoint's radius that the search aims at: the body ends a cycle slightly off the
prediction."""
SAMPLES = 10
"""Moments of a cycle at which the distance to a waypoint is checked."""


class MotionPrimitives:
    """Displacement of each action of a repertoire in a cycle, in the plane."""

    def __init__(self, repertoire: Repertoire, scale: float = 1.0) -> None:
        travels = [segment.flat_travel() for segment in repertoire.segments]
        stretch = np.array([scale, scale, 1.0])
        marks = [np.linspace(0, len(t) - 1, SAMPLES + 1).round().astype(int)[1:] for t in travels]
        self.travel = np.array([t[m] * stretch for t, m in zip(travels, marks, strict=True)])
        """(A, SAMPLES, 3) x, y, heading in the frame at the beginning of the cycle."""
        self.duration_s = np.array([segment.duration_s for segment in repertoire.segments])
        """(A,) durations of the actions, s."""
        kinds = [segment.kind for segment in repertoire.segments]
        self.tried: Ints = np.flatnonzero(np.isin(kinds, ["forward", "left", "right"]))
        """(B,) actions of which the search makes sequences: it never goes back or rests."""
        end = self.travel[:, -1]
        chord = np.hypot(end[:, 0], end[:, 1])
        best = int(np.argmax(chord / self.duration_s))
        self.speed_m_s = float(chord[best] / self.duration_s[best])
        """Largest."""
        self.turn_rad_s = max(float(np.abs(end[:, 2] / self.duration_s).max()), 1e-3)
        """Largest."""
        self.course_rad = float(np.arctan2(end[best, 1], end[best, 0]) - 0.5 * end[best, 2])
        """Direction of travel against the body frame's x at the beginning of a cycle."""

    def after(self, pose: Floats, action: int) -> Floats:
        """(3,) where ``action`` leads from ``pose`` (3,) in a cycle."""
        return np.asarray(pose + about_up(pose[2]) @ self.travel[action, -1])


def plane_pose(frame: Frame) -> Floats:
    """(3,) x, y and heading."""
    return np.array([frame.origin_m[0], frame.origin_m[1], frame.heading_rad])


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
    primitives: MotionPrimitives,
    start: ArrayLike,
    waypoints_m: Sequence[tuple[float, float]],
    radius_m: float,
    *,
    reached: int = 0,
    beam: int = 400,
    depth: int = 60,
) -> Route:
    """Beam search: the quickest sequence that passes within ``radius_m`` of all waypoints in order.

    Each round tries every action after each of the ``beam`` best sequences. The value of one is its
    duration plus a lower estimate of the rest: the distance at the largest speed, and the turn
    towards the next waypoint.

    Returns:
        the quickest that reaches all, or the best of the last round if none does within ``depth``.

    """
    goals = np.asarray(waypoints_m, dtype=float).reshape(-1, 2)
    begin = np.asarray(start, dtype=float)[None]
    if reached >= len(goals):
        return Route((), begin, reached, 0.0, 0)
    after = np.append(np.cumsum(np.hypot(*np.diff(goals, axis=0).T)[::-1])[::-1], 0.0)
    level = _SequenceLevel(
        begin, np.array([reached]), np.zeros(1), None, np.zeros(1, int), np.zeros(1, int)
    )
    best: tuple[_SequenceLevel, int] | None = None
    candidates = 0
    for _ in range(depth):
        ends, count, spent = _expanded_sequences(primitives, level, goals, radius_m)
        candidates += len(ends)
        cost = spent + _remaining_s(primitives, ends, count, goals, after, radius_m)
        order = np.argsort(cost, kind="stable")[:beam]
        parent, action = np.divmod(order, len(primitives.tried))
        level = _SequenceLevel(
            ends[order], count[order], spent[order], level, parent, primitives.tried[action]
        )
        done = level.passed >= len(goals)
        if done.any():
            first = int(np.argmin(np.where(done, level.time_s, np.inf)))
            if best is None or level.time_s[first] < best[0].time_s[best[1]]:
                best = level, first
        is_open = ~done
        if best is not None:
            is_open &= cost[order] < best[0].time_s[best[1]]
        if not is_open.any():
            break
        level = level.only(np.flatnonzero(is_open))
    return _backtracked_route(*(best or (level, 0)), candidates)


@dataclass(frozen=True, slots=True)
class _SequenceLevel:
    """Sequences of one length, and the level that they continue."""

    pose: Floats
    """(n, 3) poses at the ends of the sequences."""
    passed: Ints
    """(n,) waypoints."""
    time_s: Floats
    """(n,) durations of the sequences, s."""
    before: "_SequenceLevel | None"
    parent: Ints
    """(n,) in ``before``."""
    action: Ints
    """(n,) actions that lead to this state."""

    def only(self, which: Ints) -> "_SequenceLevel":
        return _SequenceLevel(
            self.pose[which],
            self.passed[which],
            self.time_s[which],
            self.before,
            self.parent[which],
            self.action[which],
        )


def _expanded_sequences(
    primitives: MotionPrimitives, level: _SequenceLevel, goals: Floats, radius_m: float
) -> tuple[Floats, Ints, Floats]:
    """Every action after each sequence: (nB, 3) poses, (nB,) waypoints passed, (nB,) time."""
    c, s = np.cos(level.pose[:, 2]), np.sin(level.pose[:, 2])
    travel = primitives.travel[primitives.tried]
    duration_s = primitives.duration_s[primitives.tried]
    x, y = travel[None, :, :, 0], travel[None, :, :, 1]
    at_x = level.pose[:, 0, None, None] + c[:, None, None] * x - s[:, None, None] * y
    at_y = level.pose[:, 1, None, None] + s[:, None, None] * x + c[:, None, None] * y
    count = np.repeat(level.passed[:, None], len(travel), axis=1)
    for k in range(SAMPLES):  # in time: a cycle may pass two waypoints
        goal = goals[np.minimum(count, len(goals) - 1)]
        gap = np.hypot(at_x[:, :, k] - goal[:, :, 0], at_y[:, :, k] - goal[:, :, 1])
        count += (gap <= radius_m) & (count < len(goals))
    heading = level.pose[:, 2, None] + travel[None, :, -1, 2]
    ends = np.stack([at_x[:, :, -1], at_y[:, :, -1], heading], axis=2)
    spent = level.time_s[:, None] + duration_s
    return ends.reshape(-1, 3), count.ravel(), spent.ravel()


def _backtracked_route(level: _SequenceLevel, level_index: int, candidates: int) -> Route:
    reached = int(level.passed[level_index])
    time_s = float(level.time_s[level_index])
    poses = [level.pose[level_index]]
    actions = []
    before: _SequenceLevel | None = level
    while before is not None and before.before is not None:
        actions.append(int(before.action[level_index]))
        level_index = int(before.parent[level_index])
        before = before.before
        poses.append(before.pose[level_index])
    return Route(tuple(actions[::-1]), np.array(poses[::-1]), reached, time_s, candidates)


def _remaining_s(
    primitives: MotionPrimitives,
    pose: Floats,
    count: Ints,
    goals: Floats,
    after: Floats,
    radius_m: float,
) -> Floats:
    """(n,) estimate of the remaining time, s."""
    which = np.minimum(count, len(goals) - 1)
    to = goals[which] - pose[:, :2]
    distance = np.hypot(to[:, 0], to[:, 1])
    off = np.arctan2(to[:, 1], to[:, 0]) - pose[:, 2] - primitives.course_rad
    left = (np.maximum(distance - radius_m, 0.0) + after[which]) / primitives.speed_m_s
    return np.where(
        count >= len(goals), 0.0, left + 0.5 * np.abs(wrap(off)) / primitives.turn_rad_s
    )
