"""A helix that rolls: round a pole, or inside a pipe.

The backbone is a helix of radius ``a`` and rise angle ``g``: curvature ``cos^2 g / a``, torsion
``sin g cos g / a``. Its bend turns about the body along the body (``torsion``) and with the phase:
the body rolls about its own line and the helix stays. Without slip, a body of radius r moves ``2 pi
r cos g`` along the axis in a cycle.
"""

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import places

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

SOURCE = (
    "M. Tesch et al., Parameterized and scripted gaits for modular snake robots, Advanced "
    "Robotics 23, 2009 (rolling helix); curve: H. Yamada, S. Hirose, Study of active cord "
    "mechanism: approximations to continuous curves of a multi-joint body, J. RSJ 26, 2008"
)


def helix_joints_rad(
    robot: "RobotConfig", phase_rad: Floats, radius_m: float, rise_rad: float, hand: int
) -> Floats:
    """(T, J) angles of a helix whose body has turned about its own line by phases (T,).

    A joint gets the exact integral of ``k_axis(s) = k cos(torsion s + phase)`` over half a spacing
    of its axis before and behind it.

    Args:
        robot: has yaw and pitch joints.
        phase_rad: turn of the bend's direction about the body, from left to up.
        radius_m: of the centre line; ``inf`` for a straight body.
        rise_rad: angle of the line against a plane across the axis.
        hand: 1 right-handed, -1 left-handed.

    """
    curvature = math.cos(rise_rad) ** 2 / radius_m
    torsion = hand * math.sin(rise_rad) * math.cos(rise_rad) / radius_m
    joints = np.zeros((len(phase_rad), robot.joint_count))
    for axis_joints, lead in ((robot.yaw_joints, 0.0), (robot.pitch_joints, -0.5 * np.pi)):
        if not axis_joints:
            continue
        ends = robot.link_ends
        spacing_m = (ends[axis_joints[-1] + 1] - ends[axis_joints[0] + 1]) / max(
            len(axis_joints) - 1, 1
        )
        stretch_m = robot.mean_link_length_m * (spacing_m or 1.0)
        bend = curvature * stretch_m * np.sinc(0.5 * torsion * stretch_m / np.pi)
        angle = lead - torsion * robot.length_m * places(robot, axis_joints)
        joints[:, axis_joints] = bend * np.cos(phase_rad[:, None] + angle)
    return joints


Turns = Annotated[float, Field(ge=0.0, le=2.0, description="turns of the body a second")]
BodyRadius = Annotated[float, Field(ge=0.002, le=0.5, description="radius of the robot's body")]
Rise = Annotated[float, Field(ge=0.05, le=1.2, description="rise angle of the helix")]
LeftHanded = Annotated[bool, Field(description="helix; right-handed otherwise")]
Backward = Annotated[bool, Field(description="tail first")]


class HelixPoleParameters(GaitParameters):
    """The pole and the grip."""

    frequency_hz: Turns = 0.2
    pole_radius_m: float = Field(0.09, ge=0.02, le=1.0, description="radius of the pole")
    body_radius_m: BodyRadius = 0.03
    grip_m: float = Field(0.012, ge=-0.05, le=0.2, description="helix tighter than the pole by")
    rise_rad: Rise = 0.3
    left_handed: LeftHanded = False
    backward: Backward = False


class HelixPipeParameters(GaitParameters):
    """The pipe and the pressure."""

    frequency_hz: Turns = 0.2
    pipe_radius_m: float = Field(0.15, ge=0.04, le=1.0, description="inner")
    body_radius_m: BodyRadius = 0.03
    press_m: float = Field(0.025, ge=-0.05, le=0.3, description="helix wider than the pipe by")
    rise_rad: Rise = 0.35
    left_handed: LeftHanded = False
    backward: Backward = False


class _Helix(Gait):
    """Common part: pole and pipe touch opposite sides of the body, so the roll is reversed."""

    source = SOURCE
    needs = Needs(yaw=True, pitch=True)
    aim = "climb"
    p_gain = 300
    inside: ClassVar[bool]

    @abstractmethod
    def _radius_m(self) -> float: ...

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        hand = -1 if p.left_handed else 1
        direction = hand * (-1 if p.backward else 1) * (-1 if self.inside else 1)
        return helix_joints_rad(robot, direction * phase_rad, self._radius_m(), p.rise_rad, hand)

    def advance_m(self) -> float:
        """Advance along the axis in a cycle, without slip: ``2 pi r cos g``."""
        p = self.params
        return float(2.0 * np.pi * p.body_radius_m * math.cos(p.rise_rad))


class HelixPole(_Helix):
    """Curls round a pole and rolls up it."""

    name = "helix-pole"
    title = "wound round a pole, the body rolls about its own line and climbs"
    model = HelixPoleParameters
    world = "pole"
    inside = False

    def _radius_m(self) -> float:
        p = self.params
        return float(max(p.pole_radius_m + p.body_radius_m - p.grip_m, 1e-3))


class HelixPipe(_Helix):
    """Presses outwards against a pipe and rolls up it."""

    name = "helix-pipe"
    title = "coiled inside a pipe, the body presses outwards, rolls and climbs"
    model = HelixPipeParameters
    world = "pipe"
    inside = True

    def _radius_m(self) -> float:
        p = self.params
        return float(max(p.pipe_radius_m - p.body_radius_m + p.press_m, 1e-3))
