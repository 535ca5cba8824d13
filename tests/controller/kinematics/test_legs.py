"""Segments of legs are where MuJoCo has them, and as long as the robot says."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.kinematics.legs import leg_segments_m
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import MujocoPlant

ROBOTS = ("salamander", "quadruped")


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_and_feet_are_those_of_the_physics(name: str) -> None:
    robot = load_robot(name)
    mechanics = MujocoPlant(robot, load_world("flat")).mechanics
    model, data = mechanics.model, mechanics.data
    rng = np.random.default_rng(3)
    for _ in range(5):
        turn, at = Rotation.random(random_state=rng), rng.normal(size=3)
        angles = rng.uniform(-1.1, 1.1, robot.joint_count)
        data.qpos[:3], data.qpos[3:7] = at, turn.as_quat(scalar_first=True)
        data.qpos[7:] = angles
        mujoco.mj_kinematics(model, data)
        body = body_in_world(robot, BodyPose(0.0, at, turn.as_matrix()), angles)
        ends_m = leg_segments_m(robot, body, angles)
        for k, joint in enumerate(robot.limb_joints):
            link = robot.link_count + k
            np.testing.assert_allclose(ends_m[k, 0], data.body(f"link{link}").xpos, atol=1e-9)
            if joint.has_foot:
                np.testing.assert_allclose(ends_m[k, 1], data.geom(f"foot{link}").xpos, atol=1e-9)


def test_a_robot_without_legs_has_none() -> None:
    robot = load_robot("yaw16")
    still = np.zeros(robot.joint_count)
    body = body_in_world(robot, BodyPose(0.0, np.zeros(3), np.eye(3)), still)
    assert leg_segments_m(robot, body, still).shape == (0, 2, 3)
