"""Sidewinding: waves in plane and height, a quarter cycle apart, move the body sideways."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import two_waves_rad

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class SidewindingParameters(GaitParameters):
    """Two waves of the same length."""

    winding_rad: float = Field(0.7, ge=0.0, le=1.4, description="body against its axis, in plan")
    lift_rad: float = Field(0.12, ge=0.0, le=0.8, description="body against its axis, in height")
    waves: float = Field(1.5, ge=0.75, le=3.0, description="number of waves on the body")
    lead_rad: float = Field(
        float(np.pi / 2),
        ge=-np.pi,
        le=np.pi,
        description="phase of the wave in height; its sign selects the side",
    )
    turn_rad: float = Field(0.0, ge=-1.5, le=1.5, description="bend of the axis over the body")


class Sidewinding(Gait):
    """Parts of the body rest on the ground while the parts between are lifted across."""

    name = "sidewinding"
    title = "two waves a quarter apart carry the body sideways over ground of any friction"
    source = (
        "J. W. Burdick, J. Radford, G. S. Chirikjian, A sidewinding locomotion gait for "
        "hyper-redundant robots, 1993; as compound serpenoid: Tesch et al., IROS 2009"
    )
    needs = Needs(yaw=True, pitch=True)
    model = SidewindingParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        joints = two_waves_rad(robot, phase_rad, (p.winding_rad, p.lift_rad), p.waves, p.lead_rad)
        joints[:, robot.yaw_joints] += p.turn_rad / len(robot.yaw_joints)
        return joints
