"""Source switch: a motion source that changes from one source to another while it runs."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.blend import Blend
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.motion.wrapper import MotionWrapper


class SourceSwitch(MotionWrapper):
    """Begins at rest where its first source begins; ``join`` changes the source, C1."""

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
        """Whether a join is under way."""
        return not self._blend.over

    def join(self, source: MotionSource) -> float:
        """Hand over to ``source``; returns the duration of the join, s.

        Raises:
            InputError: the robot lacks joints that it needs.
            ValueError: it asks for more than the robot's limits.

        """
        source.needs.check(self._robot, "this motion")
        blend = Blend(self.goal_rad(), self.velocity_rad_s(), source, self._limit)
        self._blend = self.wrapped = blend
        return blend.join.duration_s

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        return self._blend.step(dt_s, view)
