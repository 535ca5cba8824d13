"""Rectilinear motion: a wave in height along a body with a fixed shape in plan."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import TURN, joint_amplitude_rad, places, travelling

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class RectilinearParameters(GaitParameters):
    """One wave in the pitch joints."""

    lift_rad: float = Field(0.2, ge=0.0, le=1.2, description="body against the ground")
    waves: float = Field(2.5, ge=1.0, le=4.0, description="number of waves on the body")
    stance_rad: float = Field(
        0.4, ge=0.0, le=1.0, description="winding of a still S in plan: keeps it from rolling over"
    )
    turn_rad: float = Field(0.0, ge=-1.5, le=1.5, description="bend of the body in plan")


class Rectilinear(Gait):
    """The crests that touch the ground move the body; it needs no space at the sides."""

    name = "rectilinear"
    title = "a wave in height runs along a straight body, which goes forward through its own width"
    source = (
        "M. Tesch et al., Parameterized and scripted gaits for modular snake robots, "
        "Advanced Robotics 23, 2009: linear progression"
    )
    needs = Needs(pitch=True)
    model = RectilinearParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        pitch = robot.pitch_joints
        yaw = robot.yaw_joints
        joints = np.zeros((len(phase_rad), robot.joint_count))
        lift = joint_amplitude_rad(robot, pitch, p.lift_rad, p.waves)
        joints[:, pitch] = lift * travelling(robot, pitch, -phase_rad, p.waves, 0.0)
        if yaw:
            bend = joint_amplitude_rad(robot, yaw, p.stance_rad, 1.0)
            joints[:, yaw] = bend * np.sin(TURN * places(robot, yaw)) + p.turn_rad / len(yaw)
        return joints
