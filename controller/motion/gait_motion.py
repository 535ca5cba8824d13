"""A gait in time: its phase runs, its parameters change live, it keeps to the robot's limits."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig
from controller.gaits.gait import CYCLE_SAMPLES, Gait, Needs
from controller.motion.relay import Relay
from controller.motion.source import Pace
from controller.runtime.body import BodyView

Floats = NDArray[np.float64]
TURN = 2.0 * np.pi
HEADROOM = 0.9
"""Share of the robot's limits that a gait may take: the rest is left for joins."""
STOP_S = 1.0


class Cycle:
    """One gait with fixed parameters, running; slowed down where its joints would be too fast."""

    done = False

    def __init__(self, gait: Gait, robot: RobotConfig, phase_rad: float = 0.0) -> None:
        """Check the gait against the robot.

        Raises:
            InputError: joints are missing, or do not bend so far.

        """
        gait.check(robot)
        self.gait = gait
        self.phase_rad = phase_rad
        self._robot = robot
        step = TURN / (CYCLE_SAMPLES - 1)
        phases = np.arange(-1, CYCLE_SAMPLES + 1, dtype=np.float64) * step
        cycle = gait.joints_rad(robot, phases)
        slope = np.abs(np.diff(cycle, axis=0)).max(axis=0) / step
        bend = np.abs(np.diff(cycle, n=2, axis=0)).max(axis=0) / step**2
        speed = HEADROOM * robot.joint_speed_limit_rad_s / max(float(slope.max()), 1e-9)
        hard = HEADROOM * robot.joint_acceleration_limit_rad_s2 / max(float(bend.max()), 1e-9)
        self.rate_rad_s = min(TURN * gait.params.frequency_hz, speed, float(np.sqrt(hard)))
        """Of the phase."""
        self._pace = Pace(slope * self.rate_rad_s, bend * self.rate_rad_s**2)

    @property
    def needs(self) -> Needs:
        """Those of the gait."""
        return self.gait.needs

    @property
    def frequency_hz(self) -> float:
        """Cycles a second: as asked, or what the joints can follow."""
        return float(self.rate_rad_s / TURN)

    def goal_rad(self) -> Floats:
        """(J,) at the phase now."""
        return np.asarray(self.gait.joints_rad(self._robot, np.array([self.phase_rad]))[0])

    def velocity_rad_s(self) -> Floats:
        """(J,) central difference over 2e-4 rad of phase."""
        around = self.phase_rad + np.array([-1e-4, 1e-4])
        before, after = self.gait.joints_rad(self._robot, around)
        return np.asarray((after - before) / 2e-4 * self.rate_rad_s)

    def pace(self) -> Pace:
        """Largest over a cycle."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Turn the phase on."""
        self.phase_rad = (self.phase_rad + dt_s * self.rate_rad_s) % TURN
        return self.goal_rad()


class GaitMotion:
    """A gait that starts from rest, whose parameters change without a step, and that can stop."""

    def __init__(
        self,
        gait: Gait,
        robot: RobotConfig,
        *,
        phase_rad: float = 0.0,
        duration_s: float | None = None,
    ) -> None:
        """Make it ready at ``phase_rad``; after ``duration_s`` it comes to rest by itself.

        Raises:
            InputError: joints are missing, or do not bend so far.

        """
        self._robot = robot
        self._cycle = Cycle(gait, robot, phase_rad)
        self._relay = Relay(robot, self._cycle)
        self._left_s = duration_s
        self._stopping_s: float | None = None
        self.cycles = 0.0
        """Gone through so far."""

    @property
    def gait(self) -> Gait:
        """What runs now."""
        return self._cycle.gait

    @property
    def phase_rad(self) -> float:
        """Of the gait, 0 to 2 pi."""
        return self._cycle.phase_rad

    @property
    def frequency_hz(self) -> float:
        """Cycles a second now."""
        return self._cycle.frequency_hz * self._rate

    @property
    def needs(self) -> Needs:
        """Those of the gait."""
        return self._cycle.needs

    @property
    def done(self) -> bool:
        """Whether it has come to rest after ``stop`` or its duration."""
        return self._stopping_s is not None and self._stopping_s >= STOP_S

    @property
    def stopping(self) -> bool:
        """Whether it is coming to rest, or has."""
        return self._stopping_s is not None

    def change(self, **values: Any) -> float:
        """Give parameters new values, at the phase now; returns the time until they are in force.

        Raises:
            InputError: no such parameter, out of range, or beyond the joints; nothing changes then.

        """
        kept = self.gait.params.model_dump()
        return self.become(type(self.gait).of(kept | values))

    def become(self, gait: Gait) -> float:
        """Turn into another gait at the phase now; returns the time that it takes, s.

        Raises:
            InputError: joints are missing, or do not bend so far; nothing changes then.

        """
        cycle = Cycle(gait, self._robot, self.phase_rad)
        duration_s = self._relay.join(cycle)
        self._cycle = cycle
        return duration_s

    def stop(self) -> None:
        """Come to rest within ``STOP_S``."""
        if self._stopping_s is None:
            self._stopping_s = 0.0

    @property
    def _rate(self) -> float:
        if self._stopping_s is None:
            return 1.0
        x = min(self._stopping_s / STOP_S, 1.0)
        return 1.0 - x * x * (3.0 - 2.0 * x)

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self._relay.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return self._rate * self._relay.velocity_rad_s()

    def pace(self) -> Pace:
        """That of the gait, or the robot's limits while it changes."""
        return self._relay.pace()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        if self._left_s is not None:
            self._left_s -= dt_s
            if self._left_s <= 0.0:
                self.stop()
        part_s = dt_s
        if self._stopping_s is not None:
            before = self._rate
            self._stopping_s += dt_s
            part_s = 0.5 * (before + self._rate) * dt_s
        self.cycles += part_s * self._cycle.frequency_hz
        return self._relay.step(part_s, view)
