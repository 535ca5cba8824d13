"""Rolling: an arc-shaped body turns about its own line."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class RollingParameters(GaitParameters):
    """One bend that rotates."""

    bend_rad: float = Field(1.2, ge=0.1, le=5.0, description="bend of the whole body")


class Rolling(Gait):
    """All yaw joints together, all pitch joints a quarter cycle behind."""

    name = "rolling"
    title = "the body lies in an arc and rolls sideways like a log"
    source = (
        "M. Tesch et al., Parameterized and scripted gaits for modular snake robots, "
        "Advanced Robotics 23, 2009: rolling"
    )
    needs = Needs(yaw=True, pitch=True)
    model = RollingParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        joints = np.zeros((len(phase_rad), robot.joint_count))
        for joints_of_axis, wave in (
            (robot.yaw_joints, np.cos(phase_rad)),
            (robot.pitch_joints, np.sin(phase_rad)),
        ):
            joints[:, joints_of_axis] = self.params.bend_rad / len(joints_of_axis) * wave[:, None]
        return joints
