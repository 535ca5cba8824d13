"""Joints that another program commands during a run: goals, trajectories, gaits, velocities.

A command is accepted or rejected as a whole. Between commands the joints continue from their
present angles and speeds.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np
from scipy.interpolate import PPoly

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.gaits.lateral_undulation import LateralUndulation
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.blend import Blend
from snakewalk.controller.motion.command import (
    TIMEOUT_S,
    Command,
    GoTo,
    HoldStill,
    JointGoals,
    JointTrajectory,
    StartGait,
    Velocity,
)
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.rate_limiter import RateLimiter
from snakewalk.controller.motion.refusals import Refusals
from snakewalk.controller.motion.source import HEADROOM, MotionSource, Pace
from snakewalk.controller.motion.trajectory import (
    JointLimits,
    JointsNow,
    spline_through,
)
from snakewalk.controller.motion.velocity_gait import VelocityGait

_GAIN_PER_S = 20.0
_REACHED_GOAL_RAD = 1e-3
_JOIN_STEP_S = 0.02
"""Steps in which a join is tried before it begins."""


class _Follow:
    """Joints move to their goals and stay."""

    def __init__(self, now: JointsNow, limits: JointLimits) -> None:
        """Come to rest as soon as the limits allow."""
        self._acceleration_rad_s2 = HEADROOM * limits.acceleration_rad_s2
        speed_rad_s = HEADROOM * limits.speed_rad_s
        self._limiter = RateLimiter(
            now.angle_rad, speed_rad_s, self._acceleration_rad_s2, _GAIN_PER_S
        )
        self._limiter.speed_rad_s = np.array(now.speed_rad_s)
        self._most_rad = limits.angle_rad
        self.left_s: float | None = None
        """Time until the goals expire; None: they never do."""
        self.goal_rad = now.angle_rad
        self.stop()

    @property
    def arrived(self) -> bool:
        return bool(np.abs(self.goal_rad - self._limiter.angle_rad).max() < _REACHED_GOAL_RAD)

    def stop(self) -> None:
        """Come to rest as soon as the limits allow."""
        speed = self._limiter.speed_rad_s
        brake_rad = speed * np.abs(speed) / self._acceleration_rad_s2
        goal_rad = self._limiter.angle_rad + brake_rad
        self.goal_rad = np.clip(goal_rad, -self._most_rad, self._most_rad)
        self.left_s = None

    def now(self) -> JointsNow:
        return JointsNow(self._limiter.angle_rad, self._limiter.speed_rad_s)

    def step(self, dt_s: float, view: BodyView) -> None:
        if self.left_s is not None:
            self.left_s -= dt_s
        self._limiter.step(dt_s, self.goal_rad)


class Commanded:
    """A motion source that holds the initial pose until another program commands it."""

    needs = Needs()
    done = False

    def __init__(
        self,
        robot: RobotConfig,
        joints: Sequence[str],
        commands: Callable[[], Iterable[Command]],
        on_event: Callable[[str, str], None],
        *,
        timeout_s: float = TIMEOUT_S,
        gait: Gait | None = None,
    ) -> None:
        """Let ``commands`` control a robot.

        Args:
            robot: its limits are kept.
            joints: J names of its joints in commands, head first.
            commands: returns the commands since the last call, oldest first, without waiting.
            on_event: called with ("command", text) when an action begins or ends, ("refused", text)
                and ("stale", text).
            timeout_s: without renewal, joints stop on their way to goals after this time, and a
                moving body comes to rest; infinite disables this.
            gait: initial gait; None: hold.

        """
        self._robot = robot
        self._commands = commands
        self._on_event = on_event
        self._limits = JointLimits.of(robot, joints)
        self._timeout_s = timeout_s
        self._first = gait
        self._waiting: Callable[[], MotionSource] | None = None
        """Makes the source that is begun as soon as a join to it keeps the joints' limits."""
        self._driven: VelocityGait | None = None
        """Gait that follows velocities, from the first such command to another kind of command."""
        self._driven_by: Gait = LateralUndulation()
        self._driven_s = 0.0
        """Time until the velocity expires."""
        rest = np.zeros(robot.joint_count)
        self._mode: _Mode = _Follow(JointsNow(rest, rest), self._limits)
        self._time_s = 0.0
        self._refusals = Refusals(lambda why: on_event("refused", why))

    def start_at(self, joint_rad: Floats) -> None:
        """Start from joints at these angles (J,), clipped to their limits."""
        most = self._limits.angle_rad
        held_rad = np.clip(joint_rad, -most, most)
        self._mode = _Follow(JointsNow(held_rad, np.zeros(len(held_rad))), self._limits)

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self._mode.now().angle_rad

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        return self._mode.now().speed_rad_s

    def pace(self) -> Pace:
        """Limits of the robot, since later commands are unknown."""
        return Pace.limit(self._robot)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Execute new commands, then advance by ``dt_s``."""
        self._time_s += dt_s
        if self._first is not None:
            self._accept_command(StartGait(self._first))
            self._first = None
        for command in self._commands():
            self._accept_command(command)
        self._refusals.step(self._time_s)
        if self._waiting is not None:
            self._join(self._waiting, view)
        self._mode.step(dt_s, view)
        mode = self._mode
        if isinstance(mode, _SplineMotion) and mode.over:
            self._follow()
            self._on_event("command", "the trajectory is done")
        elif isinstance(mode, _Follow) and mode.left_s is not None:
            if mode.arrived:
                mode.left_s = None
            elif mode.left_s <= 0.0:
                mode.stop()
                text = f"no joint goals for {self._timeout_s:g} s: the joints hold where they are"
                self._on_event("stale", text)
        if self._driven is not None:
            self._check_velocity_age(dt_s)
        return self.goal_rad()

    def _check_velocity_age(self, dt_s: float) -> None:
        assert self._driven is not None
        before_s, self._driven_s = self._driven_s, self._driven_s - dt_s
        if before_s > 0.0 >= self._driven_s and not self._driven.rests:
            self._driven.stop()
            text = f"no velocity for {self._timeout_s:g} s: the body comes to rest"
            self._on_event("stale", text)

    def _accept_command(self, command: Command) -> None:
        try:
            if isinstance(command, JointGoals):
                self._go_to(command)
            elif isinstance(command, JointTrajectory):
                spline, end_s = spline_through(command, self._mode.now(), self._limits)
                self._mode = _SplineMotion(spline, end_s)
                self._waiting = None
                self._driven = None
                points = len(command.time_s)
                self._on_event("command", f"a trajectory of {points} points, {end_s:.2f} s")
            elif isinstance(command, StartGait):
                self._move_by(command.gait)
            elif isinstance(command, Velocity):
                self._drive(command)
            elif isinstance(command, HoldStill):
                self._waiting = self._driven = None
                self._follow().stop()
                self._on_event("command", "hold")
            elif isinstance(command, GoTo):
                raise InputError("goal pose: this run has no waypoints; use run NAME --live --ros")
            else:
                raise InputError(command.why)
        except InputError as error:
            self._refusals.add(error.faults[0], self._time_s)

    def _follow(self) -> _Follow:
        if not isinstance(self._mode, _Follow):
            self._mode = _Follow(self._mode.now(), self._limits)
        return self._mode

    def _go_to(self, command: JointGoals) -> None:
        joints = self._limits.numbers(command.joints, "joint goals")
        angle_rad = np.asarray(command.position_rad, dtype=float)
        if angle_rad.shape != joints.shape:
            raise InputError(
                f"joint goals: {len(joints)} names and {angle_rad.size} positions; give a position "
                "for each name"
            )
        self._limits.check_angles(angle_rad[None], joints, "joint goals")
        self._waiting = self._driven = None
        follow = self._follow()
        follow.goal_rad = np.array(follow.goal_rad)
        follow.goal_rad[joints] = angle_rad
        follow.left_s = self._timeout_s

    def _move_by(self, gait: Gait) -> None:
        if gait.p_gain is not None:
            raise InputError(
                f"gait {gait.name}: needs soft servos (P gain {gait.p_gain}), which are set up "
                "before a run; use snakewalk gait run"
            )
        gait.check(self._robot)
        self._waiting = lambda: GaitMotion(gait, self._robot)
        self._driven = None
        if gait.follows_velocity:
            self._driven_by = gait
        self._on_event("command", f"gait {gait.name}")

    def _drive(self, command: Velocity) -> None:
        if self._driven is None and not any(command):
            self._waiting = None
            self._follow().stop()
            return
        driven = self._driven or VelocityGait(self._driven_by, self._robot)
        driven.follow(*command)
        self._driven_s = self._timeout_s
        if self._driven is not None:
            return
        self._driven = driven
        self._waiting = self._copy_of_driven
        self._on_event("command", f"velocities, by gait {self._driven_by.name}")

    def _copy_of_driven(self) -> VelocityGait:
        assert self._driven is not None
        return self._driven.restarted()

    def _join(self, make: Callable[[], MotionSource], view: BodyView) -> None:
        """Join a source if every joint stays in its range; else move towards its first pose."""
        tried = self._blend(make())
        most_rad = self._limits.angle_rad
        first_rad = tried.target.goal_rad()
        within = (np.abs(tried.goal_rad()) <= most_rad + _REACHED_GOAL_RAD).all()
        while within and not tried.over:
            within = (np.abs(tried.step(_JOIN_STEP_S, view)) <= most_rad + _REACHED_GOAL_RAD).all()
        if within:
            blend = self._blend(make())
            self._mode = _BySource(blend)
            self._waiting = None
            if isinstance(blend.target, VelocityGait):
                self._driven = blend.target
            return
        follow = self._follow()
        follow.goal_rad = np.clip(first_rad, -most_rad, most_rad)
        follow.left_s = None

    def _blend(self, source: MotionSource) -> Blend:
        """Join a source to the present motion of the joints."""
        now = self._mode.now()
        return Blend(now.angle_rad, now.speed_rad_s, source, Pace.limit(self._robot))


class _Mode(Protocol):
    """Present motion of the joints."""

    def now(self) -> JointsNow: ...

    def step(self, dt_s: float, view: BodyView) -> None:
        """Advance by ``dt_s``."""
        ...


class _SplineMotion:
    """Joints follow a spline in time."""

    def __init__(self, spline: PPoly, end_s: float) -> None:
        self._spline = spline
        self._end_s = end_s
        self._now_s = 0.0

    @property
    def over(self) -> bool:
        return self._now_s >= self._end_s

    def now(self) -> JointsNow:
        return JointsNow(self._spline(self._now_s), self._spline(self._now_s, 1))

    def step(self, dt_s: float, view: BodyView) -> None:
        self._now_s = min(self._now_s + dt_s, self._end_s)


class _BySource:
    """Joints move by a gait, joined to their earlier motion."""

    def __init__(self, blend: Blend) -> None:
        self._blend = blend

    def now(self) -> JointsNow:
        return JointsNow(self._blend.goal_rad(), self._blend.velocity_rad_s())

    def step(self, dt_s: float, view: BodyView) -> None:
        self._blend.step(dt_s, view)
