"""Side rolls: a body rolls like a log up a slope that its walk does not climb.

An arc with its ends uphill rolls up 20 degrees by its girth per turn; one that opens downhill tips
over. The best wave makes 0.05 m/s straight up 18 degrees, and nothing from rest at the foot. After
a missed waypoint each decision compares the predicted speeds of the best rollout and of a roll. The
walk's last piece of track is then the arc. The joins have no step in speed.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from snakewalk.config.arrays import Floats
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
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.predictive_walker import PredictiveWalker
from snakewalk.controller.walk.roll_planner import (
    FREQUENCY_HZ,
    JOIN_S,
    MOST_TURNS,
    RollPlan,
    RollPlanner,
)
from snakewalk.controller.walk.twin_answers import TwinAsker
from snakewalk.controller.walk.twin_rollout import TwinRollout

LEAST_SPEED_M_S = 0.04
"""Least speed of a roll towards its target (ours): the walk climbs at that speed."""
_TARGET_M = 2.5
"""Farthest target on the path."""
_UPRIGHT_RAD = 0.6
"""Largest roll of a body that lies as the arc needs."""
_DROP_M = 0.1
"""Height lost since the highest place, at which a roll stops."""
_JOIN_TURN_RAD = 0.3
"""Angle of the last turn that the join makes."""
_AGAIN_BODIES = 0.5
"""Travel of the walk between two rolls."""
_SLOW_PROGRESS = 0.3
"""Progress of the walk from which nothing is tried on a twin (ours)."""
_TRY_AGAIN_BODIES = 0.4
"""Travel of the walk between two trials of rolls."""
_LAID_S = 12.0
"""Longest time until the walk's last piece ends."""
_WALK_ON_S = 1.5
"""Cost of walking again after a roll."""
_LOST_M = 0.15
"""Increase of the distance to the target at which a roll stops."""
_GAIN_M, _GAIN_S = 0.03, 3.0
"""A roll stops if it gains less distance in this time (ours)."""
_OFF_PATH_M = 0.2
"""Distance from the path after a roll from which another path is planned (ours)."""


class SideRolls(MotionWrapper, OnCourse):
    """A ``MotionSource`` with ``PathProgress``: a pilot's walk, and rolls if they climb better.

    It needs a round body, and pitch joints that carry links.
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
        """Begin with the walk of ``pilot``, whose chooser is ``walker``.

        The walk needs no roll above the predicted progress ``climb_progress``, in units of
        ``pulse_m_s``. ``on_event`` is called with the kind of an event, and a line of text.
        """
        OnCourse.__init__(self, pilot.course)
        self._pilot = pilot
        self._walker = walker
        self._robot = robot
        self._planner = planner
        self._climb_progress = climb_progress
        self._pulse_m_s = pulse_m_s
        self._on_event = on_event
        self._switch = SourceSwitch(robot, pilot)
        MotionWrapper.__init__(self, self._switch)
        self._plan: RollPlan | None = None
        self._rolling: _Rolling | None = None
        self._walks_until = 0.0
        self.decision: Decision | None = None
        """Decision of the last step, if there was one."""

    @property
    def needs(self) -> Needs:
        """Needs of the walk, and pitch joints."""
        return Needs(yaw=True, pitch=True, wheels=True)

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
        """Speed of the shape along the body; 0 in a roll or when the walk begins again."""
        return 0.0 if self.rolling or self._switch.blending else self._pilot.pulse_m_s

    def pace(self) -> Pace:
        """The robot's limits, because the next motion is unknown."""
        return self._pilot.pace()

    def use_twin(self, twin: TwinRollout) -> None:
        """Let the walk try pieces of track on a twin."""
        self._pilot.use_twin(twin)

    def use_asker(self, asker: TwinAsker) -> None:
        """Let the walk ask a twin in another process about pieces of track."""
        self._pilot.use_asker(asker)

    def use_friction(self, friction: FrictionConfig) -> None:
        """Let the walk use this friction."""
        self._pilot.use_friction(friction)

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the walk begins."""
        return self._pilot.begin(view)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
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
        """Plan a roll after the latest decision, if it climbs better."""
        course = self.course
        progress = self._walker.outlook
        if (
            course.complete
            or not course.astray
            or self._switch.blending
            or progress >= self._climb_progress
            or self._pilot.head < self._walks_until
            or abs(body_roll_rad(view)) > _UPRIGHT_RAD
        ):
            return
        plan = self._best_roll(view, self._target_m(view))
        if plan is None or plan.speed_m_s < max(LEAST_SPEED_M_S, progress * self._pulse_m_s):
            return
        self._plan = plan
        if plan.at_once:
            self.decision = None  # it is not walked
            self._roll(view, plan)
        else:
            self._pilot.end_on(plan.piece_rad)

    def _target_m(self, view: BodyView) -> Floats:
        """(2,) the next waypoint if it is near, else a point ahead on the path.

        A path that turns the body around leads away from a waypoint at its side.
        """
        next_one = self.course.next_waypoint
        if next_one is not None and np.hypot(*(next_one[0] - view.centre_m[:2])) <= _TARGET_M:
            return next_one[0]
        return self.course.ahead_m(_TARGET_M)

    def _best_roll(self, view: BodyView, target_m: Floats) -> RollPlan | None:
        """Return the fastest roll to a target: on the twin if there is one, else on paper."""
        pose = self._pilot.path_pose(view)
        twin = self._pilot.twin
        if twin is None:
            return self._planner.best(pose, self._walker, target_m)
        if self._walker.outlook >= _SLOW_PROGRESS:
            return None
        plans = self._planner.tried(pose, self._walker, target_m, view.heading_rad)
        tried_plans = [self._tried_roll(plan, view, twin) for plan in plans]
        travel = _TRY_AGAIN_BODIES * self._walker.track.points
        self._walks_until = self._pilot.head + travel
        return max(tried_plans, key=lambda plan: plan.speed_m_s, default=None)

    def _tried_roll(self, plan: RollPlan, view: BodyView, twin: TwinRollout) -> RollPlan:
        roll = _RollOnTwin(
            self._pilot.coasting(plan.piece_rad),
            _cycle(plan, self._robot),
            self._robot,
            at_once=plan.at_once,
        )
        begin_m = least_m = float(np.hypot(*(view.centre_m[:2] - plan.target_m)))
        time_s = 0.0
        best_m_s = 0.0
        turns = 1
        bodies = twin.bodies(roll.move, _LAID_S + JOIN_S + plan.turns / FREQUENCY_HZ)
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
                    best_m_s = speed_m_s
                    turns = max(1, round(roll.turns))
        except RuntimeError:  # the twin diverged
            best_m_s = 0.0
        return replace(plan, speed_m_s=best_m_s, turns=turns)

    def _roll(self, view: BodyView, plan: RollPlan) -> None:
        headings = view.headings_rad
        bent = plan.side * float(headings[0] - headings[-1]) > 0.5 * abs(plan.bend_rad)
        is_lying = bent or plan.at_once
        if not self.course.astray or not is_lying or abs(body_roll_rad(view)) > _UPRIGHT_RAD:
            self._plan = None
            self._pilot.go_on(self._walker.restart_decision)
            return
        self._plan = plan
        cycle = _cycle(plan, self._robot)
        self._switch.join(cycle)
        self._rolling = _Rolling(plan, cycle.frequency_hz, view)
        word = "left" if plan.side > 0.0 else "right"
        self._on_event("roll", f"rolls uphill to its {word}: {plan.turns} turns are planned")

    def _walk_on(self, view: BodyView, rolling: "_Rolling") -> None:
        self._on_event("roll", rolling.text(view))
        self._plan = self._rolling = None
        self._pilot.restart(view, self._walker.restart)
        self._switch.join(self._pilot)
        self._walks_until = self._pilot.head + _AGAIN_BODIES * self._walker.track.points
        course = self.course
        if not course.complete and course.off_path_m > _OFF_PATH_M:
            course.lay_from_here("the roll has ended off the path", lambda: view.heading_rad)


def _cycle(plan: RollPlan, robot: RobotConfig) -> GaitCycle:
    parameters = RollingParameters(
        frequency_hz=FREQUENCY_HZ, bend_rad=abs(plan.bend_rad), mirror=plan.side < 0.0
    )
    return GaitCycle(Rolling(parameters), robot)


class _RollOnTwin:
    """Moves a twin along the rest of a track, then in a roll."""

    def __init__(
        self, pilot: Pilot, cycle: GaitCycle, robot: RobotConfig, *, at_once: bool
    ) -> None:
        """Accept a coasting pilot; ``at_once`` skips the track."""
        self._pilot = pilot
        self._cycle = cycle
        self._robot = robot
        self._at_once = at_once
        self._roll: Blend | None = None
        self._rolled_s = 0.0

    @property
    def turns(self) -> float:
        return self._rolled_s * self._cycle.frequency_hz

    def move(self, dt_s: float, view: BodyView) -> Floats:
        """Goals (J,) of the next cycle."""
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
        self._plan = plan
        self._hz = frequency_hz
        self._turns = plan.turns
        self._start_m = view.centre_m
        self._highest_m = float(view.centre_m[2])
        self._least_m = np.inf
        self._gained_s = 0.0
        self._roll_rad = body_roll_rad(view)
        self._turned_rad = self._time_s = 0.0

    def is_over(self, dt_s: float, view: BodyView, planner: RollPlanner) -> bool:
        """Whether to stop: turns done, time over, rolling down or away, or no gain."""
        roll_rad = body_roll_rad(view)
        self._turned_rad -= self._plan.side * float(wrap(roll_rad - self._roll_rad))
        self._roll_rad = roll_rad
        self._time_s += dt_s
        self._highest_m = max(self._highest_m, float(view.centre_m[2]))
        to_target_m = float(np.hypot(*(view.centre_m[:2] - self._plan.target_m)))
        if to_target_m < self._least_m - _GAIN_M:
            self._least_m = to_target_m
            self._gained_s = self._time_s
        if to_target_m > self._least_m + _LOST_M or self._time_s > self._gained_s + _GAIN_S:
            return True
        if view.centre_m[2] < self._highest_m - _DROP_M:
            return True
        if self._time_s > JOIN_S + 1.5 * self._turns / self._hz:
            return True
        if self._turned_rad < 2.0 * np.pi * self._turns - _JOIN_TURN_RAD:
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
        travelled_m = float(np.hypot(*(view.centre_m - self._start_m)[:2]))
        turns = self._turned_rad / (2.0 * np.pi)
        return f"rolled {turns:.1f} turns in {self._time_s:.1f} s, {travelled_m:.2f} m; walks on"
