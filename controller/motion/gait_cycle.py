"""One gait in time: its phase runs at the given rate, or as fast as the joints can follow."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import CYCLE_SAMPLES, Gait, Needs
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import HEADROOM, Pace


class GaitCycle:
    """A running gait with fixed parameters, slowed down if its joints would be too fast."""

    done = False

    def __init__(self, gait: Gait, robot: RobotConfig, phase_rad: float = 0.0) -> None:
        """Check the gait against the robot.

        Raises:
            InputError: joints are missing, or their limits are too small.

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
        """Rate of the phase."""
        self._pace = Pace(slope * self.rate_rad_s, bend * self.rate_rad_s**2)

    @property
    def needs(self) -> Needs:
        """Needs of the gait."""
        return self.gait.needs

    @property
    def frequency_hz(self) -> float:
        """Cycles per second: the given frequency, or the largest that the joints can follow."""
        return float(self.rate_rad_s / TURN)

    def goal_rad(self) -> Floats:
        """(J,) joint targets at the present phase."""
        return np.asarray(self.gait.joints_rad(self._robot, np.array([self.phase_rad]))[0])

    def velocity_rad_s(self) -> Floats:
        """(J,) central difference over 2e-4 rad of phase."""
        around = self.phase_rad + np.array([-1e-4, 1e-4])
        before, after = self.gait.joints_rad(self._robot, around)
        return np.asarray((after - before) / 2e-4 * self.rate_rad_s)

    def pace(self) -> Pace:
        """Largest values over a cycle."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance the phase by ``dt_s``."""
        self.phase_rad = (self.phase_rad + dt_s * self.rate_rad_s) % TURN
        return self.goal_rad()
