"""Side rolls: a body that its walk does not bring up a slope rolls up it like a log.

Straight up a slope of 18 degrees the best wave makes 0.05 m/s, and a body that stands at the foot
of such a slope stays there. The same body in an arc, its ends uphill, rolls up 20 degrees as fast
as it turns, by its girth a turn. (An arc that opens downhill stands on its bend, and tips over.) So
where the way to a waypoint was missed, each decision compares two predictions of how fast the
waypoint comes nearer: of the best rollout, and of a roll. To roll, the last piece of the walk's
track is an arc, laid out by the same rollout; rolling is joined to it, and the walk to rolling,
without a step in speed.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.gaits.rolling import Rolling, RollingParameters
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.roll_compensation import body_roll_rad
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.blend import Blend
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.predictive_walker import PredictiveWalker
from snakewalk.controller.walk.steering import PathPose
from snakewalk.controller.walk.twin_rollout import TwinRollout

ARCS_RAD = np.array([-2.4, -2.0, -1.6, 1.6, 2.0, 2.4])
"""Bends of the whole body, of which one is chosen to roll in (ours)."""
FREQUENCY_HZ = 1.0
"""Turns a second (ours); joints at their limit slow it."""
MOST_TURNS = 16
LEAST_SPEED_M_S = 0.04
"""At which a roll has to bring the body nearer to its target (ours): the walk climbs so fast."""
_TARGET_M = 2.5
"""Farthest target on the path."""
_JOIN_S = 1.5
"""What joining costs, there and back."""
_UPHILL = 0.7
"""Cosine between a roll and the way straight up, at least."""
_LEAST_SLOPE = 0.07
_UPRIGHT_RAD = 0.6
"""A body that has rolled by more does not lie as the arc is meant."""
_DROP_M = 0.1
"""A body that has come down by so much since it was highest rolls down: it stops."""
_EARLY_RAD = 0.3
"""Of a whole turn, left to the join."""
_AGAIN_BODIES = 0.5
"""Travel of the walk between two rolls."""
_TURNS_RAD = np.array([1.2, 2.4])
"""Turns of the walk away from the arc, before it, of which one is chosen (ours)."""
_AT_ONCE_RAD = np.array([-2.6, -2.0, -1.4, 1.4, 2.0, 2.6])
"""Bends that the joints take at once, without a piece of track (ours)."""
_TRIES = 6
"""Plans that are tried on a twin, those first that are fastest on paper (ours)."""
_SLOW = 0.3
"""Progress of the walk from which on nothing is tried on a twin (ours)."""
_TRY_AGAIN_BODIES = 0.4
"""Travel of the walk between two times that rolls are tried."""
_LAID_S = 12.0
"""Longest that the walk may take to its last piece's end."""
_WALK_ON_S = 1.5
"""What it costs to walk again after a roll."""
_LOST_M = 0.15
"""A body that is so much farther from its target than it was rolls away: it stops."""
_GAIN_M, _GAIN_S = 0.03, 3.0
"""A body that has come nearer by less for so long rolls on the spot: it stops (ours)."""
_OFF_PATH_M = 0.2
"""A body that a roll has left so far off its path goes on by another (ours)."""
_STEPS_M = 0.05 * np.eye(2)
"""In x and in y, to either side: what the slope under the body is taken from."""


@dataclass(frozen=True, slots=True)
class RollPlan:
    """An arc to lie in, and whole turns in it."""

    bend_rad: float
    """Of the whole body, positive to the left; it rolls to the side to which it bends."""
    piece_rad: Floats
    """(n,) the walk's last piece of track; empty where the joints bend at once."""
    turns: int
    target_m: Floats
    """(2,) that it shall come near to."""
    speed_m_s: float
    """At which the target comes nearer, joins and all."""

    @property
    def at_once(self) -> bool:
        """Whether the joints bend at once, without a piece of track."""
        return not len(self.piece_rad)

    @property
    def side(self) -> float:
        """1 to the left, -1 to the right."""
        return float(np.sign(self.bend_rad))


class RollPlanner:
    """Predicts rolls of one robot on one ground: one girth a turn, across the body's mean line."""

    def __init__(
        self,
        robot: RobotConfig,
        ground: HeightField,
        safe: Callable[[Floats], bool] = lambda point_m: True,
    ) -> None:
        """``safe`` says whether the centre (2,) of a body may come to a place."""
        self._robot, self._ground, self._safe = robot, ground, safe
        self.turn_m = 2.0 * np.pi * robot.body_radius_m
        """Way of one turn, without slip."""

    def best(self, pose: PathPose, walker: PredictiveWalker, target_m: Floats) -> RollPlan | None:
        """Return the roll that brings the body to its target fastest; None if none does."""
        plans = list(self._plans(pose, walker, target_m))
        return max(plans, key=lambda plan: plan.speed_m_s, default=None)

    def to_go_m(self, target_m: Floats, links_m: Floats, heading_rad: float, side: float) -> Floats:
        """Distance (k + 1,) from the target now and after each of k whole turns.

        They end where the body would not roll uphill any more, or come to unsafe ground.

        Args:
            target_m: (2,)
            links_m: (L, 2) where the links are.
            heading_rad: of the body's mean line.
            side: 1 to roll to the left, -1 to the right.

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
        heights_m = np.array([self._height_m(links_m + shift) for shift in shifts_m])
        for turns in range(MOST_TURNS):
            rise_m = heights_m[turns + 1] - heights_m[turns]
            if rise_m < _LEAST_SLOPE * self.turn_m or not self._safe(centres_m[turns + 1]):
                return np.asarray(away_m[: turns + 1])
        return np.asarray(away_m)

    def tried(
        self, pose: PathPose, walker: PredictiveWalker, target_m: Floats, heading_rad: float
    ) -> list[RollPlan]:
        """Return plans that are worth a try, the fastest on paper first.

        Of arcs that are laid by the track, at once or after a turn away from them, and of bends
        that the joints take at once.

        Args:
            pose: of the body.
            walker: of the track.
            target_m: (2,)
            heading_rad: of the body's mean line.

        """
        plans = self._plans(pose, walker, target_m)
        for turn in _TURNS_RAD.tolist():
            plans += self._plans(pose, walker, target_m, turn)
        for bend in _AT_ONCE_RAD.tolist():
            plans += self._plan(pose, target_m, bend, np.empty(0), pose.centre_m, heading_rad, 0.0)
        return sorted(plans, key=lambda plan: -plan.speed_m_s)[:_TRIES]

    def _plans(
        self, pose: PathPose, walker: PredictiveWalker, target_m: Floats, turn_rad: float = 0.0
    ) -> list[RollPlan]:
        """Plans of arcs by the track, after a turn to the other side."""
        points, plans = walker.track.points, list[RollPlan]()
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
        """Return the plan to roll in an arc that lies so after ``laid_s``; none if none is nearer.

        The arc's centre (2,) and heading are those of its mean line.
        """
        links_m = self._arc_m(centre_m, heading_rad, bend_rad)
        to_go_m = self.to_go_m(target_m, links_m, heading_rad, float(np.sign(bend_rad)))
        turns = int(np.argmin(to_go_m))
        if turns == 0:
            return []
        gain_m = float(np.hypot(*(target_m - pose.centre_m))) - float(to_go_m[turns])
        speed_m_s = gain_m / (laid_s + _JOIN_S + turns / FREQUENCY_HZ)
        return [RollPlan(bend_rad, piece_rad, turns, target_m, speed_m_s)]

    def _arc_m(self, centre_m: Floats, heading_rad: float, bend_rad: float) -> Floats:
        """Centres (L, 2) of links that lie in an arc."""
        ends = np.array(self._robot.link_ends)
        angle = heading_rad + bend_rad * (0.5 - 0.5 * (ends[:-1] + ends[1:]) / ends[-1])
        forward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        lengths_m = np.array(self._robot.link_lengths_m)[:, None]
        at_m = np.cumsum(-lengths_m * forward, axis=0)  # their ends towards the tail
        at_m += 0.5 * (lengths_m - self._robot.mean_link_length_m) * forward
        return np.asarray(centre_m + at_m - at_m.mean(axis=0))

    def _height_m(self, points_m: Floats) -> float:
        return float(self._ground.elevation_m(points_m[:, 0], points_m[:, 1]).mean())


class SideRolls(OnCourse):
    """A ``MotionSource`` with ``PathProgress``: a pilot's walk, and rolls where they climb better.

    Needs a body that is round, and pitch joints that carry links.
    """

    def __init__(
        self,
        pilot: Pilot,
        walker: PredictiveWalker,
        robot: RobotConfig,
        planner: RollPlanner,
        *,
        climb_progress: float,
        pulse_m_s: float,
        on_event: Callable[[str, str], None] = lambda kind, text: None,
    ) -> None:
        """Begin with the walk.

        Args:
            pilot: of the walk.
            walker: the pilot's chooser.
            robot: round, with yaw and pitch joints.
            planner: of rolls, for the same robot.
            climb_progress: predicted progress of the walk from which on it needs no roll.
            pulse_m_s: wanted of the walk: what its progress is a share of.
            on_event: takes the kind of an event, and a line of text.

        """
        super().__init__(pilot.course)
        self._pilot, self._walker, self._robot, self._planner = pilot, walker, robot, planner
        self._climb_progress, self._pulse_m_s = climb_progress, pulse_m_s
        self._on_event = on_event
        self._switch = SourceSwitch(robot, pilot)
        self._plan: RollPlan | None = None
        self._rolling: _Rolling | None = None
        self._walks_until = 0.0
        self._relaid: str | None = None
        self.decision: Decision | None = None
        """Made in the last step, if one was."""

    @property
    def needs(self) -> Needs:
        """Those of the walk, and pitch joints."""
        return Needs(yaw=True, pitch=True, wheels=True)

    @property
    def replanned(self) -> str | None:
        """Why another path was laid in the last step, if one was."""
        return self._relaid or self.course.replanned

    @property
    def rolling(self) -> bool:
        """Whether the body rolls."""
        return self._rolling is not None

    @property
    def done(self) -> bool:
        """Whether the walk is over."""
        return not self.rolling and not self._switch.blending and self._pilot.done

    @property
    def pulse_m_s(self) -> float:
        """How fast the shape travels along the body; 0 while it rolls or begins to walk again."""
        return 0.0 if self.rolling or self._switch.blending else self._pilot.pulse_m_s

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self._switch.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return self._switch.velocity_rad_s()

    def pace(self) -> Pace:
        """The robot's limits: what comes next is not known."""
        return self._pilot.pace()

    def use_twin(self, twin: TwinRollout) -> None:
        """Let the walk try pieces of track on a twin of the robot."""
        self._pilot.use_twin(twin)

    def use_friction(self, friction: FrictionConfig) -> None:
        """Let the walk reckon with this friction from now on."""
        self._pilot.use_friction(friction)

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the walk begins."""
        return self._pilot.begin(view)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        self._relaid = None
        if self._rolling is not None:
            self._pilot.watch(view)
            if self._rolling.is_over(dt_s, view, self._planner):
                self._walk_on(view, self._rolling)
        goal_rad = self._switch.step(dt_s, view)
        self.decision = self._pilot.decision
        if self._plan is not None and self._pilot.at_end and not self.rolling:
            self._roll(view, self._plan)
        elif self.decision is not None and self._plan is None:
            self._consider(view)
        return goal_rad

    def _consider(self, view: BodyView) -> None:
        """Let a roll follow the decision just made, if it climbs better."""
        course, progress = self.course, self._walker.outlook
        if (
            course.complete
            or not course.astray
            or self._switch.blending
            or progress >= self._climb_progress
            or self._pilot.head < self._walks_until
            or abs(body_roll_rad(view)) > _UPRIGHT_RAD
        ):
            return
        plan = self._best(view, self._target_m(view))
        if plan is None or plan.speed_m_s < max(LEAST_SPEED_M_S, progress * self._pulse_m_s):
            return
        self._plan = plan
        if plan.at_once:
            self.decision = None  # it is not walked
            self._roll(view, plan)
        else:
            self._pilot.end_on(plan.piece_rad)

    def _target_m(self, view: BodyView) -> Floats:
        """(2,) the next waypoint if it is near, else a point of the path before it.

        A path that turns a body about leads away from a waypoint beside it.
        """
        next_one = self.course.next_waypoint
        if next_one is not None and np.hypot(*(next_one[0] - view.centre_m[:2])) <= _TARGET_M:
            return next_one[0]
        return self.course.ahead_m(_TARGET_M)

    def _best(self, view: BodyView, target_m: Floats) -> RollPlan | None:
        """Return the fastest roll to a target: on the twin where there is one, else on paper."""
        pose, twin = self._pilot.path_pose(view), self._pilot.twin
        if twin is None:
            return self._planner.best(pose, self._walker, target_m)
        if self._walker.outlook >= _SLOW:
            return None
        plans = self._planner.tried(pose, self._walker, target_m, view.heading_rad)
        found = [self._tried(plan, view, twin) for plan in plans]
        travel = _TRY_AGAIN_BODIES * self._walker.track.points
        self._walks_until = self._pilot.head + travel
        return max(found, key=lambda plan: plan.speed_m_s, default=None)

    def _tried(self, plan: RollPlan, view: BodyView, twin: TwinRollout) -> RollPlan:
        """Return a plan with the turns and the speed that are best on the twin."""
        roll = _RollOnTwin(
            self._pilot.coasting(plan.piece_rad),
            _cycle(plan, self._robot),
            self._robot,
            at_once=plan.at_once,
        )
        begin_m = least_m = float(np.hypot(*(view.centre_m[:2] - plan.target_m)))
        time_s, best_m_s, turns = 0.0, 0.0, 1
        bodies = twin.bodies(roll.move, _LAID_S + _JOIN_S + plan.turns / FREQUENCY_HZ)
        try:
            for body in bodies:
                time_s += twin.cycle_s
                if roll.turns > plan.turns:
                    break
                to_go_m = float(np.hypot(*(body.centre_m[:2] - plan.target_m)))
                least_m = min(least_m, to_go_m)
                if to_go_m > least_m + 3.0 * _LOST_M:
                    break
                speed_m_s = (begin_m - to_go_m) / (time_s + _WALK_ON_S)
                if speed_m_s > best_m_s and roll.turns > 0.0:
                    best_m_s, turns = speed_m_s, max(1, round(roll.turns))
        except RuntimeError:  # it has diverged
            best_m_s = 0.0
        return replace(plan, speed_m_s=best_m_s, turns=turns)

    def _roll(self, view: BodyView, plan: RollPlan) -> None:
        """Begin to roll; walk on if the body does not lie as it was meant to."""
        headings = view.headings_rad
        bent = plan.side * float(headings[0] - headings[-1]) > 0.5 * abs(plan.bend_rad)
        lies = bent or plan.at_once
        if not self.course.astray or not lies or abs(body_roll_rad(view)) > _UPRIGHT_RAD:
            self._plan = None
            self._pilot.go_on(self._walker.think_anew)
            return
        self._plan, cycle = plan, _cycle(plan, self._robot)
        self._switch.join(cycle)
        self._rolling = _Rolling(plan, cycle.frequency_hz, view)
        word = "left" if plan.side > 0.0 else "right"
        self._on_event("roll", f"rolls uphill to its {word}: {plan.turns} turns are planned")

    def _walk_on(self, view: BodyView, rolling: "_Rolling") -> None:
        """Hand the body back to the walk."""
        self._on_event("roll", rolling.text(view))
        self._plan = self._rolling = None
        self._pilot.restart(view, self._walker.restart)
        self._switch.join(self._pilot)
        self._walks_until = self._pilot.head + _AGAIN_BODIES * self._walker.track.points
        course = self.course
        if not course.complete and course.off_path_m > _OFF_PATH_M:
            course.lay_from_here("the roll has ended off the path", lambda: view.heading_rad)
            self._relaid = course.replanned


def _cycle(plan: RollPlan, robot: RobotConfig) -> GaitCycle:
    """The gait that rolls in the arc of a plan."""
    parameters = RollingParameters(
        frequency_hz=FREQUENCY_HZ, bend_rad=abs(plan.bend_rad), mirror=plan.side < 0.0
    )
    return GaitCycle(Rolling(parameters), robot)


class _RollOnTwin:
    """Moves a twin along the rest of a track, and then in a roll."""

    def __init__(
        self, pilot: Pilot, cycle: GaitCycle, robot: RobotConfig, *, at_once: bool
    ) -> None:
        """Take a pilot that coasts; ``at_once``: it rolls from where the body is."""
        self._pilot, self._cycle, self._robot = pilot, cycle, robot
        self._at_once = at_once
        self._roll: Blend | None = None
        self._rolled_s = 0.0

    @property
    def turns(self) -> float:
        """That were asked of the body so far."""
        return self._rolled_s * self._cycle.frequency_hz

    def move(self, dt_s: float, view: BodyView) -> Floats:
        """Goals (J,) of the next cycle, of length ``dt_s``."""
        if self._roll is not None:
            self._rolled_s += dt_s
            return self._roll.step(dt_s, view)
        goal_rad = self._pilot.goal_rad() if self._at_once else self._pilot.step(dt_s, view)
        if self._at_once or self._pilot.at_end:
            self._roll = Blend(
                goal_rad, self._pilot.velocity_rad_s(), self._cycle, Pace.limit(self._robot)
            )
        return goal_rad


class _Rolling:
    """A roll under way."""

    def __init__(self, plan: RollPlan, frequency_hz: float, view: BodyView) -> None:
        self._plan, self._hz, self._turns = plan, frequency_hz, plan.turns
        self._start_m = view.centre_m
        self._highest_m = float(view.centre_m[2])
        self._least_m, self._gained_s = np.inf, 0.0
        self._roll_rad = body_roll_rad(view)
        self._turned_rad = self._time_s = 0.0

    def is_over(self, dt_s: float, view: BodyView, planner: RollPlanner) -> bool:
        """Whether the turns are made, or it takes too long, or the body rolls down."""
        roll_rad = body_roll_rad(view)
        self._turned_rad -= self._plan.side * float(wrap(roll_rad - self._roll_rad))
        self._roll_rad = roll_rad
        self._time_s += dt_s
        self._highest_m = max(self._highest_m, float(view.centre_m[2]))
        to_target_m = float(np.hypot(*(view.centre_m[:2] - self._plan.target_m)))
        if to_target_m < self._least_m - _GAIN_M:
            self._least_m, self._gained_s = to_target_m, self._time_s
        if to_target_m > self._least_m + _LOST_M or self._time_s > self._gained_s + _GAIN_S:
            return True
        if view.centre_m[2] < self._highest_m - _DROP_M:
            return True
        if self._time_s > _JOIN_S + 1.5 * self._turns / self._hz:
            return True
        if self._turned_rad < 2.0 * np.pi * self._turns - _EARLY_RAD:
            return False
        to_go_m = planner.to_go_m(
            self._plan.target_m,
            view.link_m[:, :2],
            view.heading_rad,
            self._plan.side,
        )
        if self._turns == MOST_TURNS or len(to_go_m) == 1 or to_go_m[1] >= to_go_m[0]:
            return True
        self._turns += 1
        return False

    def text(self, view: BodyView) -> str:
        """How it went."""
        gone_m = float(np.hypot(*(view.centre_m - self._start_m)[:2]))
        turns = self._turned_rad / (2.0 * np.pi)
        return f"rolled {turns:.1f} turns in {self._time_s:.1f} s, {gone_m:.2f} m; walks on"
