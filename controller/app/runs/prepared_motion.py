"""What jobs share whose motion follows no path: it takes its time, wherever the body comes to."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import mean_heading_rad
from snakewalk.controller.runlog.record import Laid, PlanSummary


@dataclass(frozen=True)
class PreparedMotion:
    """Everything that is known before a servo moves; subclasses know the motion."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    gain: float = field(default=float("nan"), init=False)

    @cached_property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        return build_ground(self.world)

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return self.run.start_heading_rad or 0.0

    def _laid_in(self, joint_rad: Floats) -> Laid:
        """With joints at angles (J,)."""
        return Laid(self.start_heading_rad - mean_heading_rad(self.robot, joint_rad), joint_rad)

    def _no_path(self) -> PlanSummary:
        """Return the summary of a plan that stays where it starts."""
        start = np.array([self.run.start_m, self.run.start_m], dtype=float)
        return PlanSummary(start, np.zeros((0, 2)), self.run.waypoint_radius_m)
