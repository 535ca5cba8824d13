"""Predictive steering: chooses the piece of track whose rollout follows the path best.

The difference between motion and prediction, per length of pulse, is identified during the motion
and added to every rollout. Its causes are wrong friction, uneven loads, or a soft joint.
"""

from collections import deque
from dataclasses import astuple, dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.mechanics.rollout import (
    Drift,
    PlanarPose,
    Rolled,
    Rollout,
    RolloutTree,
    TabulatedPath,
)
from snakewalk.controller.mechanics.rollout_kernel import (
    ALONG,
    END_OFF,
    HEAD_OFF,
    HEADING,
    OFF_PATH,
    PASSED,
    TIME,
)
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.drivers.attitude import about_up
from snakewalk.drivers.compiling import compiled, readonly_array


@dataclass(frozen=True, slots=True)
class PathPose:
    """Pose of the body, and its path ahead."""

    head: float
    """Segments that the head has travelled along the track."""
    offset_rad: float
    """Rotation from the track's angles to the world."""
    centre_m: Floats
    """(2,) centre of mass."""
    aim_rad: float
    """Direction to the carrot on the path, in the world."""
    path: TabulatedPath
    """Path that the body follows."""
    path_at: int
    """Index of the path's point nearest to the centre."""


@dataclass(frozen=True, slots=True)
class SteeringWeights:
    """Weights of a rollout's cost, in square metres; chosen on unpublished seeds."""

    off_path: float = 1.0
    """Mean square distance of the centre from the path."""
    end: float = 1.0
    """Square distance of the centre from the path at the end of the rollout."""
    head: float = 0.5
    """Mean square distance of the head from the path."""
    heading_m: float = 0.3
    """Lever that converts the heading error at the end to a distance."""
    pass_by: float = 4.0
    """Weight of the squared distance beyond ``near_m`` at which the next waypoint is passed."""
    near_m: float = 0.2
    """Distance within which a waypoint is passed well."""
    delay_m2: float = 0.1
    """Cost of no progress; it falls linearly to 0 at the wanted pulse."""


_STEEP = 0.14
"""Slope from which weight rests on few links of a body: 8 degrees."""
_AHEAD_POINTS = 100
"""Points of the path ahead whose slope counts: a metre."""
_SPAN_SEGMENTS = 40.0
_UPDATE = 0.25
"""Share of a new measurement in the drift: a memory of four decisions, 0.4 body lengths."""


class Steering:
    """Judges pieces of track by their predicted motion."""

    def __init__(
        self,
        rollout: Rollout,
        track: AngleTrack,
        cruise_segments_s: float,
    ) -> None:
        self._rollout = rollout
        self._track = track
        self._cruise = cruise_segments_s
        self._cruise_m_s = cruise_segments_s * rollout.segment_m
        self._weights = np.array(astuple(SteeringWeights()))
        self._past: deque[PathPose] = deque()
        self._tree: RolloutTree | None = None
        self._tree_of: PathPose | None = None
        self._past_tree: RolloutTree | None = None
        self.drift = Drift()
        """Drift of the body that was identified so far."""

    def observe(self, pose: PathPose) -> None:
        """Compare the motion over the last span of pulse with its prediction."""
        past = self._past
        self._tree_of = None
        past.append(pose)
        while len(past) > 2 and past[1].head <= pose.head - _SPAN_SEGMENTS:
            past.popleft()
        before = past[0]
        pulse = pose.head - before.head
        if pulse < 0.5 * _SPAN_SEGMENTS:
            return
        self._past_tree = self._begin(before, Drift(), self._past_tree)
        predicted = self._past_tree.roll(np.empty((1, 0)), pulse)
        gap_m = pose.centre_m - predicted.centre_m[0]
        mean = pose.offset_rad + float(self._track.body_rad(pose.head).mean())
        turn = float(wrap(pose.offset_rad - predicted.offset_rad[0]))
        measured_motion = *(gap_m[:2] @ about_up(mean)[:2, :2]), turn
        was = self.drift.ahead_m, self.drift.left_m, self.drift.turn_rad
        self.drift = Drift(
            *(
                w + _UPDATE * (float(v) / pulse - w)
                for v, w in zip(measured_motion, was, strict=True)
            )
        )

    def roll_out(self, pose: PathPose, pieces_rad: Floats) -> Rolled:
        """Predict the body on pieces (C, n) appended to the track.

        The common part of the pieces is rolled out once per pose.
        """
        if self._tree is None or self._tree_of is not pose:
            self._tree = self._begin(pose, self.drift, self._tree)
            self._tree_of = pose
        return self._tree.roll(pieces_rad)

    def is_steep(self, pose: PathPose) -> bool:
        """Whether the slope under the body or a length ahead exceeds 8 degrees."""
        points_m = pose.path.points_m[pose.path_at : pose.path_at + _AHEAD_POINTS : 6]
        return self._rollout.steepest(points_m + pose.centre_m - points_m[0]) > _STEEP

    def use_friction(self, friction: FrictionConfig) -> None:
        """Use this friction from the next decision; the remainder is drift."""
        self._rollout.use_friction(friction)

    def forget(self) -> None:
        """Discard past poses, because the body did not follow its track."""
        self._past.clear()

    def judge(self, pose: PathPose, pieces_rad: Floats) -> tuple[Floats, Floats]:
        """Roll out pieces (C, n) appended to the track.

        Returns:
            Cost (C,) in square metres; progress (C,) along the path, relative to the wanted pulse
            without slip.

        """
        return self.cost(self.roll_out(pose, pieces_rad))

    def cost(self, rolled: Rolled) -> tuple[Floats, Floats]:
        """Cost and progress of rollouts, as ``judge`` returns them."""
        cost = np.empty(len(rolled.columns))
        progress = np.empty(len(rolled.columns))
        _cost(rolled.columns, self._weights, self._cruise_m_s, cost, progress)
        return cost, progress

    def _begin(self, pose: PathPose, drift: Drift, room_of: RolloutTree | None) -> RolloutTree:
        first = max(int(pose.head) - self._track.points - 1, 0)
        return self._rollout.begin(
            self._track.samples(first),
            pose.head - first,
            PlanarPose(pose.centre_m, pose.offset_rad),
            pose.path,
            pose.path_at,
            self._cruise,
            drift,
            room_of,
        )


@compiled(
    f"void(float64[:, ::1], {readonly_array(layout='C')}, float64, float64[::1], float64[::1])"
)
def _cost(
    columns: Floats, weights: Floats, cruise_m_s: float, cost: Floats, progress: Floats
) -> None:
    """Write the cost (C,) of ``Rolled``, and the progress relative to the cruise speed."""
    off_path = weights[0]
    end = weights[1]
    head = weights[2]
    heading_m = weights[3]
    pass_by = weights[4]
    near_m = weights[5]
    delay_m2 = weights[6]
    for k in range(len(columns)):
        row = columns[k]
        progress[k] = row[ALONG] / (row[TIME] * cruise_m_s)
        heading = heading_m * row[HEADING]
        beyond = max(row[PASSED] - near_m, 0.0)
        cost[k] = (
            off_path * row[OFF_PATH] * row[OFF_PATH]
            + end * row[END_OFF] * row[END_OFF]
            + head * row[HEAD_OFF] * row[HEAD_OFF]
            + heading * heading
            + pass_by * beyond * beyond
            + delay_m2 * (1.0 - progress[k])
        )
