"""The pilot: the snake walk along a path, as a motion source with path progress.

It reads the measured body, returns joint goals and counts waypoints. It requests the next shape
before the track ends. With ``feedback`` off it assumes no slip: the printed method, kept to show
its effect on a body with friction.
"""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.roll_compensation import RollCompensation, body_roll_rad
from snakewalk.controller.kinematics.rotations import offset_rad
from snakewalk.controller.mechanics.pitch_fit import PitchFitter
from snakewalk.controller.mechanics.rollout import (
    Rolled,
    TabulatedPath,
)
from snakewalk.controller.mechanics.rollout_kernel import (
    PATH_STEP_M,
)
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.course import Course, OnCourse, aim_rad
from snakewalk.controller.walk.steering import PathPose
from snakewalk.controller.walk.time_law import TimeLaw
from snakewalk.controller.walk.twin import UsesFriction
from snakewalk.controller.walk.twin_answers import Coasting, TwinAsker
from snakewalk.controller.walk.twin_rollout import LENGTH_BODIES, TwinRollout

# Segments of track left when the next piece is decided: the time law looks ahead.
_LOOKAHEAD_SEGMENTS = 6.0
_THINK_SEGMENTS = 9.0
"""Length of track, before a decision, in which it is prepared over several cycles."""
_RECENT_SEGMENTS = 30
"""Length of track behind the head, besides the body, for a twin in another process."""
_PITCH_SMOOTHING_S = 0.1

_STALLS_TO_REST = 3
"""Stalls in one place after which the body rests (ours); before the last attempt it backs out."""
_ON_SIDE_RAD = 1.3
"""Roll of a body that lies on its side (ours); it rests at its first stall."""
_BACK_BODIES = 1.5
"""Distance by which it backs out, body lengths (ours)."""

_JOIN_S = 0.4
"""Time constant with which the goals leave the last shape after backing out (ours)."""

# Shorter steps are accumulated: they are too short to measure a speed.
_SHORTEST_STEP_S = 1e-5


class ShapeChooser(Protocol):
    """Chooses shapes and appends them to the angle track."""

    track: AngleTrack

    def think(self, look: Callable[[], PathPose]) -> bool:
        """Prepare the next decision for a cycle; only the first call after one calls ``look``.

        Returns:
            Whether more thinking is useful.

        """
        ...

    def decide(self, pose: PathPose) -> Decision:
        """Append the next piece, prepared by ``think`` if there was time."""
        ...

    def restart(self, body_rad: Floats) -> None:
        """Continue from a body (N,) that did not follow the track."""
        ...


class AimedChooser(Protocol):
    """A chooser that uses only the direction of an aim."""

    track: AngleTrack

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Append the next piece towards the aim."""
        ...


class Aimed:
    """Adapts an ``AimedChooser`` to ``ShapeChooser``."""

    def __init__(self, chooser: AimedChooser) -> None:
        self._chooser = chooser
        self.track = chooser.track
        self.restart = chooser.track.restart

    def think(self, look: Callable[[], PathPose]) -> bool:
        """Return False: the chooser decides at once."""
        return False

    def decide(self, pose: PathPose) -> Decision:
        """Append the next piece towards the aim of ``pose``."""
        return self._chooser.decide(pose.offset_rad, pose.aim_rad)


@runtime_checkable
class TriesPieces(Protocol):
    """A ``ShapeChooser`` that tries pieces if ``try_piece`` is set."""

    try_piece: Callable[[PathPose, Floats], Rolled] | None


@runtime_checkable
class AsksAboutPieces(Protocol):
    """A ``ShapeChooser`` that asks about pieces; answers may arrive before it decides."""

    ask: Callable[[PathPose, Sequence[Floats]], None] | None
    answers: Callable[[], Mapping[int, Rolled | None]]


@dataclass(frozen=True, slots=True)
class PitchControl:
    """Control of the pitch joints; none on a level floor."""

    fitter: PitchFitter | None = None
    """Fits the body to the ground."""
    lead_s: float = 0.0
    """Time by which the goals are ahead, because the servos lag."""
    roll: RollCompensation | None = None


class Pilot(OnCourse):
    """Steers a chooser of shapes along a path, within the limits of the joints."""

    needs = Needs(yaw=True, wheels=True)

    def __init__(
        self,
        chooser: ShapeChooser,
        time_law: TimeLaw,
        *,
        pace: Pace,
        course: Course,
        pitch: PitchControl = PitchControl(),
        fall_back: Callable[[bool], None] | None = None,
        carrot_m: float,
        aim_at_waypoint: bool = False,
    ) -> None:
        self._chooser = chooser
        self._time_law = time_law
        self._pace = pace
        self._goal_rad = time_law.goal_rad()
        self._last_rad = self._earlier_rad = self._goal_rad
        self._last_s = self._earlier_s = self._saved_s = 0.0
        super().__init__(course)
        self._pitch_fitter = pitch.fitter
        self._fall_back = fall_back or (lambda lost: None)
        self._pitch_rad: Floats | None = None
        self._roll = pitch.roll
        self._table: TabulatedPath | None = None
        self._table_of: tuple[SplinePath, int] | None = None
        points = chooser.track.points
        self._links = len(self._goal_rad) + 1
        self._segments = np.arange(points)
        self._middles = (np.arange(self._links) + 0.5) * points / self._links - 0.5
        self._pitch_lead_s = pitch.lead_s
        self._segment_m = course.length_m / points
        self._carrot_m = carrot_m
        self._aim_at_waypoint = aim_at_waypoint
        self._twin: TwinRollout | None = None
        self._asker: TwinAsker | None = None
        self._start: tuple[Floats, float] | None = None
        self._at_rest = True
        self._decides = True
        self._has_thought = False
        self._coasts = False
        self._stalls = 0
        self._is_stuck = False
        self._back_to: float | None = None
        self._offset_rad = np.zeros(len(self._goal_rad))
        self.on_event: Callable[[str, str], None] = lambda kind, text: None
        """Receives the kind of an event, and a line of text."""
        self.decision: Decision | None = None
        """Decision of the last step, if there was one."""

    @property
    def done(self) -> bool:
        """Whether every waypoint has been reached, or the body is stuck, and the shape rests."""
        ends = self.course.complete or self._is_stuck
        return ends and self._time_law.speed_segments_s == 0.0

    @property
    def head(self) -> float:
        """Segments that the head has travelled along the track."""
        return self._time_law.head

    @property
    def pulse_m_s(self) -> float:
        """Speed of the shape along the body."""
        return self._time_law.speed_segments_s * self._segment_m

    def goal_rad(self) -> Floats:
        """(J,) current joint targets, at first those of the initial shape."""
        return self._goal_rad

    def velocity_rad_s(self) -> Floats:
        """(J,) speed half a step ago, extrapolated by its change."""
        if self._last_s == 0.0:
            return np.zeros(len(self._goal_rad))
        speed = (self._goal_rad - self._last_rad) / self._last_s
        before = (self._last_rad - self._earlier_rad) / (self._earlier_s or 1.0)
        gain_rad_s2 = (speed - before) / (0.5 * (self._last_s + self._earlier_s))
        return speed + 0.5 * self._last_s * gain_rad_s2

    def pace(self) -> Pace:
        """The robot's limits, because the next motion is unknown."""
        return self._pace

    def begin(self, view: BodyView) -> Floats:
        """Fit the first shape to the ground; return the first targets (J,)."""
        self._goal_rad = self._on_ground(0.0, view)
        self._last_rad = self._earlier_rad = self._goal_rad
        return self._goal_rad

    @property
    def at_end(self) -> bool:
        """Whether the head has reached the end of the track."""
        return self.head >= self._time_law.joints.track.end - 1.0

    def end_on(self, piece_rad: Floats) -> None:
        """Append a piece (n,) of track and decide no more until ``go_on`` or ``restart``."""
        self._chooser.track.append(piece_rad)
        self._decides = False

    def go_on(self, restart_decision: Callable[[], None]) -> None:
        """Resume deciding; ``restart_decision`` resets the chooser."""
        restart_decision()
        self._decides = True

    def watch(self, view: BodyView) -> None:
        """Count waypoints while another motion moves the body."""
        self.course.cancel_planning()
        self.course.observe(view.centre_m[:2], view.link_m[0, :2], self._fall_back)
        self.decision = None

    def restart(self, view: BodyView, restart: Callable[[Floats], None]) -> None:
        """Start again from rest with the measured body (N,); calls ``restart`` of the chooser."""
        points = self._chooser.track.points
        position = (np.arange(points) + 0.5) * self._links / points - 0.5
        restart(np.interp(position, np.arange(self._links), view.headings_rad))
        if self._twin is not None:
            self._twin.forget()
        if self._asker is not None:
            self._asker.forget()
        self._time_law.restart()
        self._pitch_rad = None
        self._at_rest = True
        self._decides = True
        self.begin(view)
        self._last_s = self._earlier_s = self._saved_s = 0.0

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        self._saved_s += dt_s
        if self._saved_s < _SHORTEST_STEP_S:
            return self._goal_rad
        dt_s, self._saved_s = self._saved_s, 0.0
        if self._back_to is not None and self._time_law.speed_segments_s <= 0.0:
            goal = self._back_out(dt_s, view)
        else:
            goal = self._move(dt_s, view) if self._coasts else self._steer(dt_s, view)
        goal = goal + self._offset_rad
        self._offset_rad = max(0.0, 1.0 - dt_s / _JOIN_S) * self._offset_rad
        self._earlier_rad, self._last_rad, self._goal_rad = self._last_rad, self._goal_rad, goal
        self._earlier_s, self._last_s = self._last_s, dt_s
        return goal

    def _steer(self, dt_s: float, view: BodyView) -> Floats:
        if self._twin is not None:
            self._twin.observe(view, dt_s)
        if self._asker is not None:
            self._asker.observe(view, dt_s)
        self.course.follow(
            view.centre_m[:2],
            view.link_m[0, :2],
            lambda: view.heading_rad,
            self.head,
            self._fall_back,
        )
        self.decision = None
        stalls = self.course.stalls
        if stalls != self._stalls:
            self._stalls = stalls
            self._meet_stall(abs(body_roll_rad(view)))
        self._has_thought = self._prepare_decision(view)
        if not self._has_thought:
            self.course.continue_planning(self._fall_back)
        if self.course.complete or self._is_stuck or self._back_to is not None:
            self._time_law.stop()
        else:
            self._time_law.go_on()
        return self._move(dt_s, view)

    def _meet_stall(self, roll_rad: float) -> None:
        """Rest if the body lies on its side, or stalls often in one place; first back out."""
        self._is_stuck = roll_rad > _ON_SIDE_RAD or self._stalls >= _STALLS_TO_REST
        if self._is_stuck:
            self.on_event(
                "stuck",
                f"no advance in {self._stalls} attempts at this place, "
                f"{np.degrees(roll_rad):.0f} degrees off upright: the body rests, and the run ends",
            )
        elif self._stalls == _STALLS_TO_REST - 1:
            self._back_to = self.head - _BACK_BODIES * self._chooser.track.points
            self.on_event("stuck", "no advance again: the body backs out the way it came")

    def _back_out(self, dt_s: float, view: BodyView) -> Floats:
        """Step back along the track; at its end continue from the shape there."""
        chooser = self._chooser
        assert self._back_to is not None
        self.watch(view)
        if self._time_law.back(self._back_to, dt_s):
            self._back_to = None
            shape_rad, before_rad = chooser.track.body_rad(self.head), self._goal_rad
            self.restart(view, lambda measured_rad: chooser.restart(shape_rad))
            self._offset_rad = before_rad - self._goal_rad
            self.course.lay_from_here("backed out", lambda: view.heading_rad)
            return self._goal_rad
        return self._on_ground(dt_s, view)

    def _prepare_decision(self, view: BodyView) -> bool:
        """Prepare the next piece of track, or decide; return whether that fills the cycle.

        While a path is planned, it gets at least every second cycle. At rest it comes first,
        because the piece depends on it.
        """
        if not self._decides or (self._at_rest and self.course.is_planning):
            return False
        if self._at_rest and self._chooser.think(lambda: self.path_pose(view)):
            return True
        left = self._chooser.track.end - self.head
        if left <= _LOOKAHEAD_SEGMENTS:
            self._at_rest = False
            self.decision = self._chooser.decide(self.path_pose(view))
            return True
        plans_now = self.course.is_planning and self._has_thought
        if left <= _LOOKAHEAD_SEGMENTS + _THINK_SEGMENTS and not plans_now:
            return self._chooser.think(lambda: self.path_pose(view))
        return False

    def _move(self, dt_s: float, view: BodyView) -> Floats:
        self._time_law.advance(dt_s)
        goal_rad = self._on_ground(dt_s, view)
        return goal_rad if self._roll is None else self._roll(goal_rad, view, dt_s)

    def use_twin(self, twin: TwinRollout) -> None:
        """Let the chooser try pieces of track on a twin."""
        if isinstance(self._chooser, TriesPieces):
            self._twin = twin
            self._chooser.try_piece = self._try_piece

    def use_asker(self, asker: TwinAsker) -> None:
        """Let the chooser ask a twin in another process about pieces of track."""
        if isinstance(self._chooser, AsksAboutPieces):
            self._asker = asker
            self._chooser.ask, self._chooser.answers = self._ask, asker.results

    def use_friction(self, friction: FrictionConfig) -> None:
        """Use this friction in the chooser and in the twins."""
        if isinstance(self._chooser, UsesFriction):
            self._chooser.use_friction(friction)
        if self._twin is not None:
            self._twin.friction = friction
        if self._asker is not None:
            self._asker.friction = friction

    @property
    def twin(self) -> TwinRollout | None:
        """The twin on which pieces of track are tried, or None."""
        return self._twin

    def coasting(self, piece_rad: Floats) -> "Pilot":
        """Return a copy that moves to the end of the track plus a piece (n,), without decisions."""
        now = Coasting(self._time_law, self._roll, self._pitch_rad)
        return self._coasting_from(now, piece_rad)

    def _coasting_from(self, state: Coasting, piece_rad: Floats) -> "Pilot":
        other = copy.copy(self)
        track = state.time_law.joints.track.with_piece(piece_rad)
        other._time_law, other._roll = state.time_law.on(track), copy.copy(state.roll)
        other._pitch_rad = state.pitch_rad
        other._coasts = True
        return other

    def _try_piece(self, pose: PathPose, piece_rad: Floats) -> Rolled:
        return self.tried_from(
            Coasting(self._time_law, self._roll, self._pitch_rad), pose, piece_rad
        )

    def _ask(self, pose: PathPose, pieces_rad: Sequence[Floats]) -> None:
        assert self._asker is not None
        recent = self._time_law.recent(_RECENT_SEGMENTS)
        self._asker.ask(pose, Coasting(recent, self._roll, self._pitch_rad), pieces_rad)

    def tried_from(self, state: Coasting, pose: PathPose, piece_rad: Floats) -> Rolled:
        """Predict the body that continues from ``state`` on a piece (n,) appended to its track.

        Raises:
            PhysicsError: the twin diverged.

        """
        assert self._twin is not None
        other = self._coasting_from(state, piece_rad)
        track = other._time_law.joints.track
        end = min(other.head + LENGTH_BODIES * track.points, track.end - _LOOKAHEAD_SEGMENTS)
        return self._twin.roll(pose, lambda: other.head >= end, other._move)

    def _on_ground(self, dt_s: float, view: BodyView) -> Floats:
        """(J,) goals of the time law, with the pitch that fits the body to the ground.

        The pitch is smoothed over ``_PITCH_SMOOTHING_S``, because the ground consists of facets.
        """
        goal_rad = self._time_law.goal_rad()
        if self._pitch_fitter is None:
            return goal_rad
        head_m, headings_rad = self._head_and_headings_ahead(view)
        target = self._pitch_fitter(head_m, headings_rad).goal_rad
        if self._pitch_rad is None:
            self._pitch_rad = target
        self._pitch_rad = self._pitch_rad + min(1.0, dt_s / _PITCH_SMOOTHING_S) * (
            target - self._pitch_rad
        )
        return goal_rad + self._pitch_rad

    def _head_and_headings_ahead(self, view: BodyView) -> tuple[Floats, Floats]:
        """Head (2,) and headings (L,) of the links ``_pitch_lead_s`` ahead on the track.

        Goals for the ground under the body now would be late.
        """
        track = self._time_law.joints.track
        head_m = view.link_m[0, :2]
        headings_rad = view.headings_rad
        pulse = min(self._pitch_lead_s * self._time_law.speed_segments_s, track.end - self.head)
        if pulse <= 0.0:
            return head_m, headings_rad
        turn = self._at_links(track.body_rad(self.head + pulse) - track.body_rad(self.head))
        headings_rad = headings_rad + turn
        forward = np.array([np.cos(headings_rad[0]), np.sin(headings_rad[0])])
        return head_m + pulse * self._segment_m * forward, headings_rad

    def _at_links(self, body: Floats) -> Floats:
        """Values (L,) at the links' middles, from values (N,) along the body."""
        return np.interp(self._middles, self._segments, body)

    def path_pose(self, view: BodyView) -> PathPose:
        """Pose of the body, and its path ahead."""
        offset, aim = self._aim(view)
        path_row = round(self.along_m / PATH_STEP_M)
        return PathPose(
            self.head, offset, view.centre_m[:2].copy(), aim, self._path_table(), path_row
        )

    def _path_table(self) -> TabulatedPath:
        path = self.path
        course = self.course
        made_of = path, course.reached
        if self._table is None or self._table_of != made_of:
            stations_m = np.arange(0.0, path.length_m, PATH_STEP_M)
            points_m = path.position(np.append(stations_m, path.length_m))
            waypoint_m, passed_m = course.next_waypoint or (None, np.inf)
            self._table = TabulatedPath.of(points_m, waypoint_m, passed_m / PATH_STEP_M)
            self._table_of = made_of
        return self._table

    def _aim(self, view: BodyView) -> tuple[float, float]:
        """Offset from track to world, and the aim's direction in the world."""
        headings_rad = view.headings_rad
        head_m = view.link_m[0, :2]
        centre_m = view.centre_m[:2]
        believed_rad = self._at_links(self._chooser.track.body_rad(self.head))
        offset = offset_rad(headings_rad, believed_rad)
        if self._start is None:
            self._start = (head_m, offset)
        waypoints_m = self.course.waypoints_m
        if self._aim_at_waypoint and len(waypoints_m):
            target = waypoints_m[min(self.reached, len(waypoints_m) - 1)]
            return offset, float(np.arctan2(*(target - centre_m)[::-1]))
        if not self.course.feedback:
            offset = self._start[1]
            head_m = self._dead_reckoned(self._start[0], offset)
            along_m = self.path.nearest(head_m, self.along_m)
            return offset, aim_rad(self.path, head_m, along_m, self._carrot_m)
        # The piece begins at the end of the track: aim from the head's position by then.
        lead_m = (self._chooser.track.end - self.head) * self._segment_m
        heading = headings_rad.mean()
        ahead_m = head_m + lead_m * np.array([np.cos(heading), np.sin(heading)])
        return offset, aim_rad(
            self.path, ahead_m, self.course.head_along_m + lead_m, self._carrot_m
        )

    def _dead_reckoned(self, start_m: Floats, offset: float) -> Floats:
        """Head of a body that never slipped since the first decision."""
        track = self._chooser.track
        return start_m + self._segment_m * track.displacement(
            track.points, round(self.head), offset
        )
