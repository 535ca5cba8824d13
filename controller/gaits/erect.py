"""Walk and trot on legs that hang down: a time chart of contacts, and joint angles of the feet.

The goat of [KP] 4.2.2 has a time chart of foot contacts, angles of leg joints, and a body that
follows the legs. Here the chart is a share of the cycle and an offset for each foot, and the paths
of the feet are given. On the ground they move backwards at one constant rate, which is the speed of
the body; in the air they return. Hip and knee follow from the position of the foot.
"""

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.footfall import lift, swing
from snakewalk.controller.gaits.gait import Frequency, GaitParameters, Needs
from snakewalk.controller.gaits.trot import LegGait, Turn
from snakewalk.controller.gaits.wave import TURN

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

AXES = "ryy"
"""Axes of a leg that hangs down: it rolls out at the trunk, hip and knee swing it."""


class ErectParameters(GaitParameters):
    """Paths of the feet, in shares of a leg's length from hip to foot."""

    frequency_hz: Frequency = 0.5
    stride: float = Field(
        0.2, ge=0.0, le=0.5, description="travel of a foot to either side of the hip"
    )
    reach: float = Field(0.85, ge=0.3, le=0.98, description="hip to foot as it stands")
    lift: float = Field(
        0.12, ge=0.0, le=0.6, description="share by which a leg shortens in the air"
    )
    stance_rad: float = Field(1.0, ge=0.5, le=1.5, description="roll of a leg down to the ground")
    turn: Turn = 0.0


class ErectGait(LegGait):
    """Legs of axes ``ryy`` by phase; the trunk is straight."""

    needs = Needs(legs=True, leg_axes=AXES)
    model = ErectParameters

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        joints = np.zeros((len(phase_rad), robot.joint_count))
        p = self.params
        first = robot.link_count - 1
        for k, joint in enumerate(robot.limb_joints):
            pair = robot.limbs[joint.pair]
            if joint.place > 0:
                continue
            joints[:, first + k] = -p.stance_rad
            left = (joint.side == "left") != p.mirror
            cycle_share = (
                phase_rad / TURN - self.offsets[2 * joint.pair + (0 if left else 1)]
            ) % 1.0
            shorter = max(p.turn if left else -p.turn, 0.0)
            upper_m, lower_m = pair.segments_m[1:]
            leg_m = upper_m + lower_m
            forward_m = leg_m * (1.0 - shorter) * p.stride * swing(cycle_share, self.duty)
            down_m = leg_m * (p.reach - p.lift * lift(cycle_share, self.duty))
            hip, knee = hip_and_knee_rad(forward_m, down_m, upper_m, lower_m)
            joints[:, first + k + 1], joints[:, first + k + 2] = hip, knee
        return joints


def hip_and_knee_rad(
    forward_m: Floats, down_m: Floats, upper_m: float, lower_m: float
) -> tuple[Floats, Floats]:
    """Hip and knee angles for a foot ``forward_m`` and ``down_m`` from the hip, knee ahead.

    Out of reach the leg points there, straight.
    """
    square = forward_m**2 + down_m**2
    cosine = (square - upper_m**2 - lower_m**2) / (2.0 * upper_m * lower_m)
    knee = -np.arccos(np.clip(cosine, -1.0, 1.0))
    ahead = np.arctan2(lower_m * np.sin(knee), upper_m + lower_m * np.cos(knee))
    return np.arctan2(forward_m, down_m) - ahead, knee


class ErectWalk(ErectGait):
    """One leg after the other, hind before front on each side."""

    name = "erect-walk"
    title = "on legs that hang down, one after the other"
    source = "N. Komodakis et al., 2005, 4.2.2: the goat; M. Hildebrand, BioScience 39, 1989"
    duty: ClassVar[float] = 0.8
    offsets = (0.75, 0.25, 0.0, 0.5)


class ErectTrot(ErectGait):
    """Diagonal legs step together."""

    name = "erect-trot"
    title = "on legs that hang down, two across from each other together"
    source = "N. Komodakis et al., 2005, 4.2.2: the goat; M. Hildebrand, BioScience 39, 1989"
    duty: ClassVar[float] = 0.5
    offsets = (0.5, 0.0, 0.0, 0.5)
