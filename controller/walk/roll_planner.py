"""Plans of side rolls: an arc to roll in, and the number of turns up a slope."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.walk.predictive_walker import PredictiveWalker
from snakewalk.controller.walk.steering import PathPose

ARCS_RAD = np.array([-2.4, -2.0, -1.6, 1.6, 2.0, 2.4])
"""Bends of the whole body (ours)."""
FREQUENCY_HZ = 1.0
"""Turns a second (ours); joints at their limit slow it."""
MOST_TURNS = 16
JOIN_S = 1.5
"""Cost of the joins to a roll and back."""
_UPHILL = 0.7
"""Least cosine between a roll and the slope's direction."""
_LEAST_SLOPE = 0.07
_TURNS_RAD = np.array([1.2, 2.4])
"""Turns of the walk away from the arc, before it (ours)."""
_IMMEDIATE_BENDS_RAD = np.array([-2.6, -2.0, -1.4, 1.4, 2.0, 2.6])
"""Bends that the joints make at once, without a piece of track (ours)."""
_TRIES = 6
"""Plans that are tried on a twin, the fastest on paper first (ours)."""
_STEPS_M = 0.05 * np.eye(2)
"""Steps in x and in y, to either side, for the slope under the body."""


@dataclass(frozen=True, slots=True)
class RollPlan:
    """An arc to lie in, and whole turns in it."""

    bend_rad: float
    """Bend of the whole body, positive to the left; it rolls to that side."""
    piece_rad: Floats
    """(n,) the walk's last piece of track; empty where the joints bend at once."""
    turns: int
    target_m: Floats
    """(2,) target of the roll, m."""
    speed_m_s: float
    """Speed at which the target comes nearer, joins included."""

    @property
    def at_once(self) -> bool:
        """Whether the joints bend at once, without a piece of track."""
        return not len(self.piece_rad)

    @property
    def side(self) -> float:
        """1 to the left, -1 to the right."""
        return float(np.sign(self.bend_rad))


class RollPlanner:
    """Predicts rolls of a robot on a ground: one girth per turn, across the body's mean line."""

    def __init__(
        self,
        robot: RobotConfig,
        ground: HeightField,
        safe: Callable[[Floats], bool] = lambda point_m: True,
    ) -> None:
        """``safe`` returns whether the body's centre (2,) may be at a place."""
        self._robot = robot
        self._ground = ground
        self._safe = safe
        self.turn_m = 2.0 * np.pi * robot.body_radius_m
        """Way of one turn, without slip."""

    def best(self, pose: PathPose, walker: PredictiveWalker, target_m: Floats) -> RollPlan | None:
        """Return the roll that approaches the target fastest, or None."""
        plans = self._plans(pose, walker, target_m)
        return max(plans, key=lambda plan: plan.speed_m_s, default=None)

    def to_go_m(self, target_m: Floats, links_m: Floats, heading_rad: float, side: float) -> Floats:
        """Distances (k + 1,) from the target (2,) now and after each whole turn.

        They end before a turn that climbs too little or comes to unsafe ground. ``links_m`` is (L,
        2), the heading is that of the body's mean line, and ``side`` is 1 (left) or -1.
        """
        turn_m = side * self.turn_m * np.array([-np.sin(heading_rad), np.cos(heading_rad)])
        uphill = np.array(
            [self._height_m(links_m + step) - self._height_m(links_m - step) for step in _STEPS_M]
        )
        shifts_m = np.arange(MOST_TURNS + 1)[:, None] * turn_m
        centres_m = links_m.mean(axis=0) + shifts_m
        away_m = np.hypot(*(centres_m - target_m).T)
        if uphill @ turn_m < _UPHILL * self.turn_m * np.hypot(*uphill):
            return np.asarray(away_m[:1])
        rises_m = np.diff([self._height_m(links_m + shift) for shift in shifts_m])
        ends = [
            rise_m < _LEAST_SLOPE * self.turn_m or not self._safe(centre_m)
            for rise_m, centre_m in zip(rises_m, centres_m[1:], strict=True)
        ]
        return np.asarray(away_m[: [*ends, True].index(True) + 1])

    def tried(
        self, pose: PathPose, walker: PredictiveWalker, target_m: Floats, heading_rad: float
    ) -> list[RollPlan]:
        """Return plans for rolls towards a target (2,), the fastest on paper first.

        The track lays an arc, maybe after a turn to the other side; or the joints make it at once.
        """
        plans = self._plans(pose, walker, target_m)
        for turn in _TURNS_RAD.tolist():
            plans += self._plans(pose, walker, target_m, turn)
        for bend in _IMMEDIATE_BENDS_RAD.tolist():
            plans += self._plan(pose, target_m, bend, np.empty(0), pose.centre_m, heading_rad, 0.0)
        return sorted(plans, key=lambda plan: -plan.speed_m_s)[:_TRIES]

    def _plans(
        self, pose: PathPose, walker: PredictiveWalker, target_m: Floats, turn_rad: float = 0.0
    ) -> list[RollPlan]:
        points = walker.track.points
        plans = list[RollPlan]()
        ramp = np.arange(1, points + 1) / points
        arcs = walker.track.last_rad + ARCS_RAD[:, None] * ramp
        if turn_rad > 0.0:
            turns = -turn_rad * np.sign(ARCS_RAD)[:, None]
            arcs = np.hstack([walker.track.last_rad + turns * ramp, arcs + turns])
        rolled = walker.steering.roll_out(pose, arcs)
        for k, bend in enumerate(ARCS_RAD.tolist()):
            heading = float(rolled.offset_rad[k] + arcs[k, -points:].mean())
            laid = rolled.centre_m[k], heading, float(rolled.time_s[k])
            plans += self._plan(pose, target_m, bend, arcs[k], *laid)
        return plans

    def _plan(
        self,
        pose: PathPose,
        target_m: Floats,
        bend_rad: float,
        piece_rad: Floats,
        centre_m: Floats,
        heading_rad: float,
        laid_s: float,
    ) -> list[RollPlan]:
        """Return the plan to roll in an arc that is complete after ``laid_s``, or None.

        The arc's centre (2,) and heading are those of its mean line.
        """
        links_m = self._arc_m(centre_m, heading_rad, bend_rad)
        to_go_m = self.to_go_m(target_m, links_m, heading_rad, float(np.sign(bend_rad)))
        turns = int(np.argmin(to_go_m))
        if turns == 0:
            return []
        gain_m = float(np.hypot(*(target_m - pose.centre_m))) - float(to_go_m[turns])
        speed_m_s = gain_m / (laid_s + JOIN_S + turns / FREQUENCY_HZ)
        return [RollPlan(bend_rad, piece_rad, turns, target_m, speed_m_s)]

    def _arc_m(self, centre_m: Floats, heading_rad: float, bend_rad: float) -> Floats:
        """Centres (L, 2) of links in an arc."""
        ends = np.array(self._robot.link_ends)
        angle = heading_rad + bend_rad * (0.5 - 0.5 * (ends[:-1] + ends[1:]) / ends[-1])
        forward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        lengths_m = np.array(self._robot.link_lengths_m)[:, None]
        at_m = np.cumsum(-lengths_m * forward, axis=0)  # tail-side ends of the links
        at_m += 0.5 * (lengths_m - self._robot.mean_link_length_m) * forward
        return np.asarray(centre_m + at_m - at_m.mean(axis=0))

    def _height_m(self, points_m: Floats) -> float:
        return float(self._ground.elevation_m(points_m[:, 0], points_m[:, 1]).mean())
