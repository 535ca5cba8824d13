"""Trot and walk of a sprawling body: legs by phase, and a spine that bends at the girdles.

The lizard of [KP] 4.2.2 is given by the angles of its legs over a cycle, on a body that may bend at
the pairs of legs. Here the angles are computed: a foot moves back at a constant rate on the ground
and returns in the air. The girdles turn with the legs in opposite directions (a standing wave),
which lengthens the strides; head and tail keep their heading.
"""

from abc import ABC
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.footfall import lift, swing
from snakewalk.controller.gaits.gait import Frequency, Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import TURN

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig


Turn = Annotated[
    float,
    Field(
        ge=-1.6,
        le=1.6,
        description="share of their stride that the inner legs leave out; positive turns left, "
        "beyond 1 they step backwards",
    ),
]


class LegParameters(GaitParameters):
    """Strides, stance and bends."""

    frequency_hz: Frequency = 0.25
    stride_rad: float = Field(0.5, ge=0.0, le=1.1, description="swing of a leg to either side")
    stance_rad: float = Field(0.6, ge=0.0, le=1.2, description="roll of a leg down to the ground")
    lift_rad: float = Field(
        0.35, ge=0.0, le=1.2, description="angle by which a leg rises in the air"
    )
    bend_rad: float = Field(0.5, ge=0.0, le=1.5, description="front girdle against hind girdle")
    turn: Turn = 0.0


class LegGait(Gait, ABC):
    """Legs of two pairs by phase; a subclass defines the order of their steps."""

    duty: ClassVar[float]
    """Share of a cycle that a foot is on the ground."""
    offsets: ClassVar[tuple[float, float, float, float]]
    """Times in cycles at which the feet come down: hind left, hind right, front left, front
    right."""
    needs = Needs(yaw=True, legs=True)
    steered_by = "turn"
    model: ClassVar[type[GaitParameters]] = LegParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        joints = np.zeros((len(phase_rad), robot.joint_count))
        self._bend(robot, phase_rad, joints)
        p = self.params
        first = robot.link_count - 1
        for k, joint in enumerate(robot.limb_joints):
            left = (joint.side == "left") != p.mirror
            cycle_share = (
                phase_rad / TURN - self.offsets[2 * joint.pair + (0 if left else 1)]
            ) % 1.0
            axis = robot.limbs[joint.pair].joint_axes[joint.place]
            if axis == "y":
                shorter = max(p.turn if left else -p.turn, 0.0)
                joints[:, first + k] = (
                    (1.0 - shorter) * p.stride_rad * swing(cycle_share, self.duty)
                )
            elif joint.place == robot.limbs[joint.pair].joint_axes.find("r"):
                joints[:, first + k] = -p.stance_rad + p.lift_rad * lift(cycle_share, self.duty)
        return joints

    def _bend(self, robot: "RobotConfig", phase_rad: Floats, joints: Floats) -> None:
        """Turn each girdle most when its legs have swung most.

        At phase 0 of its offset the left front leg is foremost: the front girdle is turned right by
        half of the bend, the hind one left.
        """
        p = self.params
        hind = robot.limbs[0].link
        front = robot.limbs[-1].link
        turned = 0.5 * p.bend_rad * np.cos(phase_rad - TURN * self.offsets[2])
        trunk = np.arange(front, hind)
        joints[:, trunk] = -2.0 * turned[:, None] / max(len(trunk), 1)
        if front > 0:
            joints[:, front - 1] += turned
        if hind < robot.link_count - 1:
            joints[:, hind] += turned


class Trot(LegGait):
    """Diagonal legs step together."""

    name = "trot"
    title = "two legs across from each other step together, the spine bends between the girdles"
    source = (
        "N. Komodakis et al., 2005, 4.2.2: the lizard; A. J. Ijspeert et al., Science 315, 2007: "
        "the salamander's trot with a standing wave"
    )
    duty = 0.5
    offsets = (0.5, 0.0, 0.0, 0.5)


class LateralWalk(LegGait):
    """One leg after the other, hind before front on each side: three feet are on the ground."""

    name = "lateral-walk"
    title = "one leg after the other, three on the ground"
    source = "M. Hildebrand, The quadrupedal gaits of vertebrates, BioScience 39, 1989"
    duty = 0.75
    offsets = (0.75, 0.25, 0.0, 0.5)
