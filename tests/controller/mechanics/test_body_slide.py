"""The slide between two shapes against the general solution of the same balance."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import body_in_world, link_weights
from snakewalk.controller.mechanics.body_slide import BodySlide
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity
from snakewalk.drivers.types import BodyPose

STEP_S = 0.02


@pytest.mark.parametrize("name", ["yaw16", "alternating16"])
def test_the_velocity_balances_friction(name: str) -> None:
    robot, friction = load_robot(name), FrictionConfig(along=0.1, across=0.6)
    slide, guess = BodySlide(link_weights(robot), friction), np.zeros(3)
    rng = np.random.default_rng(3)
    joints = rng.uniform(-0.6, 0.6, robot.joint_count)
    for _ in range(5):
        moved = joints + rng.normal(0.0, 0.01, robot.joint_count)
        before, after = (
            body_in_world(robot, BodyPose(0.0, np.zeros(3), np.eye(3)), each)
            for each in (joints, moved)
        )
        shape_m_s = (after.link_m - before.link_m)[:, :2] / STEP_S
        assert slide.set_shapes(before, after, STEP_S) == np.abs(shape_m_s).max()
        guess = rigid_velocity(
            *(before.link_m[:, :2], before.headings_rad, shape_m_s, friction, guess),
            normal=link_weights(robot),
        )
        assert slide.velocity() == pytest.approx(guess, abs=1e-9)
        joints = moved
