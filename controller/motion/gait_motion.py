"""A gait that runs, changes live and stops, within the robot's limits."""

from typing import Any

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_cycle import Cycle
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.source_switch import Relay
from snakewalk.controller.motion.stop_profile import ComingToRest


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
        self._rest = ComingToRest()
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
        return self._cycle.frequency_hz * self._rest.rate

    @property
    def needs(self) -> Needs:
        """Those of the gait."""
        return self._cycle.needs

    @property
    def done(self) -> bool:
        """Whether it has come to rest after ``stop`` or its duration."""
        return self._rest.over

    @property
    def stopping(self) -> bool:
        """Whether it is coming to rest, or has."""
        return self._rest.begun

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
        """Come to rest as ``ComingToRest`` does."""
        self._rest.stop()

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self._relay.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return self._rest.rate * self._relay.velocity_rad_s()

    def pace(self) -> Pace:
        """That of the gait, or the robot's limits while it changes."""
        return self._relay.pace()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        if self._left_s is not None:
            self._left_s -= dt_s
            if self._left_s <= 0.0:
                self.stop()
        part_s = self._rest.step(dt_s)
        self.cycles += part_s * self._cycle.frequency_hz
        return self._relay.step(part_s, view)
