"""Shape filters: which shapes this robot can use on this ground."""

from collections.abc import Callable, Mapping

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import StatesConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.shape.crossing import self_touches
from snakewalk.controller.shape.library import ShapeFilter

MADE = ("joint limits", "self-contact")
"""Tests of the robot's limits; the others select useful shapes."""


def shape_filters(
    robot: RobotConfig, friction: FrictionConfig, states: StatesConfig, points: int = 100
) -> dict[str, ShapeFilter]:
    """Tests by reason, cheapest first: each maps shapes (S, points) to a mask (S,) of bad ones.

    - The turn exceeds ``states.turn_limit_rad``. A walk never completes a coil's turn.
    - Joints exceed their limits after retargeting.
    - Parts of the body touch.
    - The quasi-static gain is below the limit (docs/method.md).
    """
    joints_rad = Retarget(robot, points).joints_rad
    limit = np.array(robot.limit_rad)

    def coiled(shapes_rad: Floats) -> Bools:
        turn = shapes_rad.mean(axis=-1) - shapes_rad[..., -1]
        return np.asarray(np.abs(turn) > states.turn_limit_rad)

    def beyond(shapes_rad: Floats) -> Bools:
        return np.asarray((np.abs(joints_rad(shapes_rad)) > limit).any(axis=-1))

    def touching(shapes_rad: Floats) -> Bools:
        return self_touches(shapes_rad, robot.length_m, robot.body_radius_m)

    def slipping(shapes_rad: Floats) -> Bools:
        return quasi_static_gain(shapes_rad, friction) < states.gain_limit

    return {
        "turn": coiled,
        "joint limits": beyond,
        "self-contact": touching,
        "traction": slipping,
    }


def passes_all(filters: Mapping[str, ShapeFilter]) -> Callable[[Floats], bool]:
    """Return a test whether one body (N,) passes every filter."""

    def passes(body_rad: Floats) -> bool:
        return not any(is_bad(body_rad[None])[0] for is_bad in filters.values())

    return passes
