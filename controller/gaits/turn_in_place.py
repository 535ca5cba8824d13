"""Turn in place: sidewinding with opposite directions of the two halves."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import places, two_waves_rad

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


class TurnInPlaceParameters(GaitParameters):
    """Parameters as for sidewinding; the lift changes its sign at the middle of the body."""

    winding_rad: float = Field(0.7, ge=0.0, le=1.4, description="body against its axis, in plan")
    lift_rad: float = Field(0.1, ge=0.0, le=0.8, description="at the ends, in height")
    waves: float = Field(1.5, ge=0.75, le=3.0, description="number of waves on the body")


class TurnInPlace(Gait):
    """The head half sidewinds to one side, the tail half to the other."""

    name = "turn-in-place"
    title = "the halves sidewind to opposite sides, the body turns about its middle"
    source = (
        "M. Tesch et al., Parameterized and scripted gaits for modular snake robots, "
        "Advanced Robotics 23, 2009: amplitude modulated along the body"
    )
    aim = "turn"
    needs = Needs(yaw=True, pitch=True)
    model = TurnInPlaceParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        joints = two_waves_rad(robot, phase_rad, (p.winding_rad, p.lift_rad), p.waves, np.pi / 2)
        joints[:, robot.pitch_joints] *= np.sign(1.0 - 2.0 * places(robot, robot.pitch_joints))
        return joints
