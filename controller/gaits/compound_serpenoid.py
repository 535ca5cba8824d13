"""The compound serpenoid: one sine wave for the yaw joints, one for the pitch joints."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import travelling

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class CompoundSerpenoidParameters(GaitParameters):
    """The family that includes the other wave gaits; amplitudes are of joints."""

    lateral_rad: float = Field(0.5, ge=0.0, le=1.5, description="amplitude of the yaw joints")
    dorsal_rad: float = Field(0.2, ge=0.0, le=1.2, description="amplitude of the pitch joints")
    lateral_offset_rad: float = Field(0.0, ge=-0.5, le=0.5, description="offset of every yaw joint")
    dorsal_offset_rad: float = Field(
        0.0, ge=-0.5, le=0.5, description="offset of every pitch joint"
    )
    lateral_waves: float = Field(
        1.5, ge=-4.0, le=4.0, description="number of waves on the body; 0: all joints together"
    )
    dorsal_waves: float = Field(
        1.5, ge=-4.0, le=4.0, description="number of waves on the body; 0: all joints together"
    )
    lead_rad: float = Field(
        float(np.pi / 2), ge=-np.pi, le=np.pi, description="phase of the pitch joints' wave"
    )
    dorsal_rate: int = Field(1, ge=1, le=3, description="cycles of the pitch joints in one")


class CompoundSerpenoid(Gait):
    """``beta + A sin(rate phase + lead - 2 pi k s)`` for each of the two axes."""

    name = "compound-serpenoid"
    title = "two sine waves, lateral and dorsal, with all their parameters: the whole family"
    source = (
        "M. Tesch et al., Parameterized and scripted gaits for modular snake robots, "
        "Advanced Robotics 23, 2009, compound serpenoid curve"
    )
    needs = Needs(yaw=True, pitch=True)
    model = CompoundSerpenoidParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        yaw = robot.yaw_joints
        pitch = robot.pitch_joints
        joints = np.zeros((len(phase_rad), robot.joint_count))
        lateral = travelling(robot, yaw, phase_rad, p.lateral_waves, 0.0)
        dorsal = travelling(robot, pitch, p.dorsal_rate * phase_rad, p.dorsal_waves, p.lead_rad)
        joints[:, yaw] = p.lateral_offset_rad + p.lateral_rad * lateral
        joints[:, pitch] = p.dorsal_offset_rad + p.dorsal_rad * dorsal
        return joints
