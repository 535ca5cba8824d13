"""The pattern generator as a motion: gait changes within the robot's limits, without a jump."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.cpg.oscillators import Cpg, CpgState
from snakewalk.controller.gaits.cpg.pattern import Pattern
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.source import Pace

GAINS = np.geomspace(10.0, 0.5, 10)
"""Gains of the amplitudes, 1/s, fastest first."""
LEAST_DIRECT = 1.5
"""Smallest gain of a direct change; smaller ones serve a change in two steps only."""
CLOCK_GAIN = 6.0
CRAWL = 0.2
"""Share of the slower gait's frequency at which the amplitudes change in a change in two steps."""
TOLERANCE = 0.02
WIDER = 0.05
"""Share by which the limits are widened where no change keeps them; doubled each time."""
SETTLE = 14.0
"""Duration of a change that is evaluated, in units of 1 / gain; 0.7 % of it remain then."""
SAMPLE_S = 0.02
MOST_SAMPLES = 600


@dataclass(frozen=True, slots=True)
class Part:
    """A target pattern and its gains."""

    pattern: Pattern
    gain: float
    """Gain of the amplitudes, 1/s."""
    clock_gain: float
    """Gain of the frequency, 1/s."""

    @property
    def time_s(self) -> float:
        """Time until the change has settled."""
        return SETTLE / min(self.gain, self.clock_gain)

    def begin(self, cpg: Cpg) -> None:
        """Set the gait as the target of the oscillators."""
        cpg.set_pattern(self.pattern, self.gain, self.clock_gain)


def quickest_change(cpg: Cpg, pattern: Pattern, limit: Pace) -> tuple[tuple[Part, ...], Pace]:
    """Choose the fastest change that keeps the limits; each is known in closed form.

    Between a wide slow gait and a narrow fast one, amplitude times frequency may exceed the limits
    of both. Then the oscillators slow down, change, and speed up again.

    Returns:
        The parts of the change in order, and the largest values during the change.

    """
    start = cpg.state()
    slow = CRAWL * min(cpg.pattern.omega_rad_s or np.inf, pattern.omega_rad_s or np.inf)
    crawl = replace(pattern, omega_rad_s=slow if np.isfinite(slow) else 0.0)
    candidates: list[tuple[Part, ...]] = [
        (Part(pattern, g, g),) for g in GAINS if g >= LEAST_DIRECT
    ]
    candidates += [(Part(crawl, g, CLOCK_GAIN), Part(pattern, g, CLOCK_GAIN)) for g in GAINS]
    enough = 1.0 + TOLERANCE
    wider = WIDER
    while True:
        for parts in candidates:
            excess, pace = _evaluate(cpg, start, parts, limit, enough)
            if excess <= enough:
                cpg.restore(start)
                return parts, pace
        enough = enough * (1.0 + wider)
        wider = 2.0 * wider


def _evaluate(
    cpg: Cpg, start: CpgState, parts: tuple[Part, ...], limit: Pace, enough: float
) -> tuple[float, Pace]:
    """Return the largest share of a limit, and the largest values; stop once above ``enough``."""
    cpg.restore(start)
    over = 0.0
    fast = np.zeros(cpg.joints)
    hard = np.zeros(cpg.joints)
    for part in parts:
        step_s = max(SAMPLE_S, part.time_s / MOST_SAMPLES)
        part.begin(cpg)
        times_s = np.arange(0.0, part.time_s, step_s)
        share, speed, change = cpg.peak_share(
            times_s, limit.speed_rad_s, limit.acceleration_rad_s2, enough
        )
        over = max(over, share)
        fast = np.maximum(fast, speed)
        hard = np.maximum(hard, change)
        if over > enough:
            break
        cpg.advance(part.time_s)
    return over, Pace(fast, hard)


DONE_RAD = 0.01
DONE_RAD_S = 0.02


@dataclass(frozen=True, slots=True)
class GaitTransition:
    """A computed change of gait, ready to begin."""

    at_s: float
    """Start, in the motion's own time."""
    parts: tuple[Part, ...]
    needs: Needs
    settled: Pace
    """Pace of the gait after the transition."""
    under_way: Pace
    stops: bool


class CpgMotion:
    """Oscillators that start at rest, adopt gaits one after the other, and can stop."""

    def __init__(self, robot: RobotConfig, joint_rad: Floats) -> None:
        """Start at rest at ``joint_rad`` (J,)."""
        self.robot = robot
        self.cpg = Cpg(np.asarray(joint_rad, dtype=float))
        self.needs = Needs()
        self._limit = Pace.limit(robot)
        self._stopping = True
        self._change = Pace.still(robot.joint_count)
        self._settled = self._change
        self._now_s = self._left_s = self._part_s = 0.0
        self._next: tuple[Part, ...] = ()
        self._scheduled: tuple[GaitTransition, ...] = ()

    @property
    def done(self) -> bool:
        """Whether it has been stopped and is at rest."""
        if not self._stopping or self._scheduled:
            return False
        far = np.abs(self.goal_rad() - self.cpg.pattern.offset_rad).max()
        return bool(far < DONE_RAD and np.abs(self.velocity_rad_s()).max() < DONE_RAD_S)

    def become(self, gait: Gait) -> float:
        """Adopt a gait as fast as the limits allow; return the duration, s.

        Raises:
            InputError: joints are missing, or their limits are too small; nothing changes then.

        """
        return self._begin(self._plan(gait))

    def stop(self) -> float:
        """Come to rest at the middle of each joint's swing; return the duration, s."""
        return self._begin(self._plan(None))

    def schedule(self, changes: Sequence[tuple[float, Gait | None]]) -> float:
        """Adopt gaits, or rest for None, at rising times from now; return the end of the last, s.

        The oscillators' course is known ahead, so all changes are computed here. A later ``become``
        or ``stop`` cancels the rest of the schedule.

        Raises:
            InputError: joints are missing, or their limits are too small; nothing changes then.

        """
        twin = copy(self)
        planned = []
        begin_s = self._now_s
        twin.cpg = copy(self.cpg)
        over_s = 0.0
        for after_s, gait in changes:
            twin._advance(begin_s + after_s - twin._now_s)
            planned.append(twin._plan(gait))
            over_s = after_s + twin._begin(planned[-1])
        self._scheduled = tuple(planned)
        return over_s

    def _plan(self, gait: Gait | None) -> GaitTransition:
        """Plan a change from the present state of the oscillators."""
        if gait is None:
            pattern = Pattern.rest(self.cpg.pattern.offset_rad)
            needs = self.needs
            settled = Pace.still(self.robot.joint_count)
        else:
            cycle = GaitCycle(gait, self.robot)
            pattern = Pattern.of(gait, self.robot, cycle.rate_rad_s)
            needs = gait.needs
            settled = cycle.pace()
        parts, under_way = quickest_change(self.cpg, pattern, self._limit)
        return GaitTransition(self._now_s, parts, needs, settled, under_way, stops=gait is None)

    def _begin(self, change: GaitTransition) -> float:
        self._scheduled = ()
        change.parts[0].begin(self.cpg)
        self._next = change.parts[1:]
        self.needs = change.needs
        self._stopping = change.stops
        self._settled = change.settled
        self._change = change.under_way
        self._part_s = change.parts[0].time_s
        self._left_s = sum(part.time_s for part in change.parts)
        return self._left_s

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self.cpg.angle_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        return self.cpg.velocity_rad_s()

    def pace(self) -> Pace:
        """Largest pace of the gait and of present and scheduled changes."""
        ahead = [self._settled, *(p for c in self._scheduled for p in (c.under_way, c.settled))]
        if self._left_s > 0.0:
            ahead.append(self._change)
        return Pace(
            np.max([pace.speed_rad_s for pace in ahead], axis=0),
            np.max([pace.acceleration_rad_s2 for pace in ahead], axis=0),
        )

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        return self._advance(dt_s)

    def _advance(self, dt_s: float) -> Floats:
        """Advance by ``dt_s``; a change begins at its own time, for any length of step."""
        end_s = self._now_s + dt_s
        while True:
            due_s = self._scheduled[0].at_s if self._scheduled else np.inf
            part_s = self._now_s + self._part_s if self._next else np.inf
            if min(due_s, part_s) > end_s:
                return self._turn_phase(end_s - self._now_s)
            self._turn_phase(max(min(due_s, part_s) - self._now_s, 0.0))
            if due_s <= part_s:
                change, *later = self._scheduled
                self._begin(change)
                self._scheduled = tuple(later)
            else:
                part, *rest = self._next
                part.begin(self.cpg)
                self._part_s, self._next = part.time_s, tuple(rest)

    def _turn_phase(self, dt_s: float) -> Floats:
        self._now_s += dt_s
        self._left_s -= dt_s
        self._part_s -= dt_s
        return self.cpg.step(dt_s)
