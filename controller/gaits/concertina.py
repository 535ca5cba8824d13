"""Concertina: a part of the body folds, and the fold runs from the tail to the head."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import TURN, bends_rad, group_places
from snakewalk.controller.kinematics.smoothstep import cubic

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

EDGE = 0.7
"""Share of the folded part over which the folds grow and vanish."""


class ConcertinaParameters(GaitParameters):
    """The fold."""

    winding_rad: float = Field(1.0, ge=0.0, le=1.5, description="folds against the body's axis")
    folds: float = Field(2.0, ge=1.0, le=6.0, description="number of folds on the body")
    share: float = Field(
        0.8, ge=0.2, le=1.0, description="share of the body that is folded at a time"
    )


class Concertina(Gait):
    """The resting parts of the body hold it by friction, also isotropic."""

    name = "concertina"
    title = "a folded part runs from tail to head; each part is drawn up while the rest holds"
    source = (
        "B. C. Jayne, Kinematics of terrestrial snake locomotion, Copeia 1986; "
        "H. Marvi, D. L. Hu, Friction enhancement in concertina locomotion, "
        "J. R. Soc. Interface 9, 2012"
    )
    needs = Needs(yaw=True)
    model = ConcertinaParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        yaw = robot.yaw_joints
        joints = np.zeros((len(phase_rad), robot.joint_count))
        group_position = group_places(robot, yaw)
        half = 0.5 * p.share
        turn = np.mod(phase_rad, TURN) / TURN
        centre = (1.0 + half - turn * (1.0 + p.share))[:, None]
        edge = np.clip((1.0 - np.abs(group_position - centre) / half) / EDGE, 0.0, 1.0)
        headings = p.winding_rad * cubic(edge) * np.sin(TURN * p.folds * group_position)
        joints[:, yaw] = bends_rad(robot, yaw, headings)
        return joints
