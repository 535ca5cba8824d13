"""Lateral undulation: a serpenoid wave in the plane; wheels or scales turn it into thrust."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import joint_amplitude_rad, travelling

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class LateralUndulationParameters(GaitParameters):
    """Hirose's serpenoid curve."""

    winding_rad: float = Field(0.7, ge=0.0, le=1.4, description="body against its axis: alpha")
    waves: float = Field(1.2, ge=0.5, le=3.0, description="number of waves on the body")
    turn_rad: float = Field(
        0.0,
        ge=-2.5,
        le=2.5,
        description="bend of the axis over the body, positive to the left; "
        "a body that goes backward turns the other way",
    )
    backward: bool = Field(False, description="tail first: the wave runs to the head")


class LateralUndulation(Gait):
    """``q_j = A sin(phase - 2 pi k s_j) + turn / n`` on the yaw joints; backward uses -phase."""

    name = "lateral-undulation"
    title = "a wave in the plane runs to the tail, the body goes forward along itself"
    source = "S. Hirose, Biologically Inspired Robots, Oxford University Press, 1993: serpenoid"
    needs = Needs(yaw=True, wheels=True)
    world = "flat"
    follows_velocity = True
    model = LateralUndulationParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        yaw = robot.yaw_joints
        joints = np.zeros((len(phase_rad), robot.joint_count))
        amplitude = joint_amplitude_rad(robot, yaw, p.winding_rad, p.waves)
        wave = travelling(robot, yaw, -phase_rad if p.backward else phase_rad, p.waves, 0.0)
        joints[:, yaw] = amplitude * wave + p.turn_rad / len(yaw)
        return joints
