"""The pattern generator as a motion: it changes gait within the robot's limits, without a jump."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig
from controller.gaits.cpg import Cpg, Pattern
from controller.gaits.gait import Gait, Needs
from controller.motion.gait_motion import Cycle
from controller.motion.source import Pace
from controller.runtime.body import BodyView

Floats = NDArray[np.float64]
Part = tuple[Pattern, float, float]
"""A pattern, and the gains with which amplitudes and frequency go to it."""

GAINS = np.geomspace(10.0, 0.5, 10)
"""Of amplitudes, 1/s, fastest first."""
LEAST_DIRECT = 1.5
"""Gains below this are for a change in two steps only."""
CLOCK_GAIN = 6.0
CRAWL = 0.2
"""Of the slower of two gaits: in a change in two steps amplitudes change at this frequency."""
TOLERANCE = 0.02
SETTLE = 14.0
"""Times 1 / gain: how long a change is looked at; 0.7 % of it are left then."""
SAMPLE_S = 0.02
MOST_SAMPLES = 600
DONE_RAD, DONE_RAD_S = 0.01, 0.02


class CpgMotion:
    """Oscillators at rest at a pose, that take up gaits one after the other and can stop."""

    def __init__(self, robot: RobotConfig, joint_rad: Floats) -> None:
        """Start at rest at ``joint_rad`` (J,)."""
        self.robot = robot
        self.cpg = Cpg(np.asarray(joint_rad, dtype=float))
        self.needs = Needs()
        self._limit = Pace.limit(robot)
        self._stopping = True
        self._change = Pace.still(robot.joint_count)
        self._settled = self._change
        self._left_s = self._part_s = 0.0
        self._next: list[Part] = []

    @property
    def done(self) -> bool:
        """Whether it has been stopped and lies still."""
        if not self._stopping:
            return False
        far = np.abs(self.goal_rad() - self.cpg.pattern.offset_rad).max()
        return bool(far < DONE_RAD and np.abs(self.velocity_rad_s()).max() < DONE_RAD_S)

    def become(self, gait: Gait) -> float:
        """Take a gait as the target, as fast as the limits allow; returns how long it takes, s.

        Raises:
            InputError: joints are missing, or do not bend so far; nothing changes then.

        """
        cycle = Cycle(gait, self.robot)
        taken_s = self._go(Pattern.of(gait, self.robot, cycle.rate_rad_s), cycle.pace())
        self.needs, self._stopping = gait.needs, False
        return taken_s

    def stop(self) -> float:
        """Come to rest at the middle of each joint's swing; returns how long it takes, s."""
        resting = Pattern.rest(self.cpg.pattern.offset_rad)
        self._stopping = True
        return self._go(resting, Pace.still(self.robot.joint_count))

    def _go(self, pattern: Pattern, settled: Pace) -> float:
        """Choose the fastest change that stays within the limits: each is known in closed form.

        Where a wide slow gait becomes a narrow fast one, or back, amplitude times frequency would
        pass its limits on the way: then the oscillators slow down, change, and speed up again.
        """
        start = self.cpg.now()
        slow = CRAWL * min(self.cpg.pattern.omega_rad_s or np.inf, pattern.omega_rad_s or np.inf)
        crawl = replace(pattern, omega_rad_s=slow if np.isfinite(slow) else 0.0)
        ways = [[(pattern, g, g)] for g in GAINS if g >= LEAST_DIRECT]
        ways += [[(crawl, g, CLOCK_GAIN), (pattern, g, CLOCK_GAIN)] for g in GAINS]
        best, least = ways[-1], np.inf
        change = settled
        for way in ways:
            self.cpg.restore(start)
            excess, pace = self._judge(way)
            if excess < least:
                best, least, change = way, excess, pace
            if excess <= 1.0 + TOLERANCE:
                break
        self.cpg.restore(start)
        self.cpg.become(*best[0])
        self._next = best[1:]
        self._settled, self._change = settled, change
        self._part_s = self._time_s(best[0])
        self._left_s = sum(map(self._time_s, best))
        return self._left_s

    @staticmethod
    def _time_s(part: Part) -> float:
        return SETTLE / min(part[1], part[2])

    def _judge(self, way: list[Part]) -> tuple[float, Pace]:
        """Largest speed or acceleration over its limit, and their largest values."""
        fast = hard = np.zeros(self.robot.joint_count)
        for part in way:
            time_s = self._time_s(part)
            step_s = max(SAMPLE_S, time_s / MOST_SAMPLES)
            self.cpg.become(*part)
            speed = self.cpg.ahead(np.arange(0.0, time_s, step_s))[1]
            self.cpg.skip(time_s)
            fast = np.maximum(fast, np.abs(speed).max(axis=0))
            hard = np.maximum(hard, np.abs(np.diff(speed, axis=0)).max(axis=0) / step_s)
        over = max(
            float((fast / self._limit.speed_rad_s).max()),
            float((hard / self._limit.acceleration_rad_s2).max()),
        )
        return over, Pace(fast, hard)

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self.cpg.angle_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return self.cpg.velocity_rad_s()

    def pace(self) -> Pace:
        """Largest of the change under way and of the gait."""
        if self._left_s <= 0.0:
            return self._settled
        return Pace(
            np.maximum(self._settled.speed_rad_s, self._change.speed_rad_s),
            np.maximum(self._settled.acceleration_rad_s2, self._change.acceleration_rad_s2),
        )

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        self._left_s -= dt_s
        self._part_s -= dt_s
        if self._part_s <= 0.0 and self._next:
            self.cpg.become(*self._next[0])
            self._part_s, self._next = self._time_s(self._next[0]), self._next[1:]
        return self.cpg.step(dt_s)
