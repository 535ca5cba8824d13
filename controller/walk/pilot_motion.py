"""The walker as a motion source: the pilot steers, anything can be joined to it and after it."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.walk.pilot import Pilot

LEAST_S = 1e-5
"""Shorter steps are saved up: of them no speed could be told."""


class PilotMotion:
    """A pilot as a ``MotionSource``; its time law keeps joints within the robot's limits."""

    needs = Needs(yaw=True, wheels=True)

    def __init__(self, pilot: Pilot, robot: RobotConfig) -> None:
        self.pilot = pilot
        self._pace = Pace.limit(robot)
        self._goal_rad = pilot.first_goal_rad()
        self._speed_rad_s = np.zeros(len(self._goal_rad))
        self._gain_rad_s2 = np.zeros(len(self._goal_rad))
        self._last_s = self._owed_s = 0.0

    @property
    def done(self) -> bool:
        """Whether every waypoint has been reached and the shape has come to rest."""
        return self.pilot.at_rest

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self._goal_rad

    def velocity_rad_s(self) -> Floats:
        """(J,) from the last steps: that of half a step ago, carried on by its change."""
        return np.asarray(self._speed_rad_s + 0.5 * self._last_s * self._gain_rad_s2)

    def pace(self) -> Pace:
        """The robot's limits: what comes next is not known."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Steer on by ``dt_s``."""
        self._owed_s += dt_s
        if self._owed_s < LEAST_S:
            return self._goal_rad
        dt_s, self._owed_s = self._owed_s, 0.0
        goal = self.pilot.step(dt_s, view)
        speed = (goal - self._goal_rad) / dt_s
        between_s = 0.5 * (dt_s + self._last_s)
        self._gain_rad_s2 = (speed - self._speed_rad_s) / between_s
        self._goal_rad, self._speed_rad_s, self._last_s = goal, speed, dt_s
        return goal
