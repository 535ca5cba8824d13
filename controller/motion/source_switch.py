"""Source switch: a motion source that changes from one source to another during a run."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.blend import Blend
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.motion.wrapper import MotionWrapper


class SourceSwitch(MotionWrapper):
    """Starts at rest at its first source; ``join`` changes the source, C1."""

    def __init__(self, robot: RobotConfig, first: MotionSource) -> None:
        first.needs.check(robot, "this motion")
        self._robot = robot
        self._limit = Pace.limit(robot)
        start = first.goal_rad()
        self._blend = Blend(start, np.zeros(len(start)), first, self._limit)
        super().__init__(self._blend)

    @property
    def source(self) -> MotionSource:
        """Present source."""
        return self._blend.target

    @property
    def blending(self) -> bool:
        """Whether a join is in progress."""
        return not self._blend.over

    def join(self, source: MotionSource) -> float:
        """Change to ``source``; return the duration of the join, s.

        Raises:
            InputError: the robot lacks joints that it needs.
            ValueError: it exceeds the robot's limits.

        """
        source.needs.check(self._robot, "this motion")
        blend = Blend(self.goal_rad(), self.velocity_rad_s(), source, self._limit)
        self._blend = self.wrapped = blend
        return blend.join.duration_s

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        return self._blend.step(dt_s, view)
