"""Backlash of the joints of a body in MuJoCo."""

import math

import numpy as np
import pytest

from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.public_steps import PublicSteps
from snakewalk.sim.servo.backlash import GAP, SIDE
from tests.sim.physics.test_gear_friction import FLAT, TERMS, drive_of, robot_with, waved

DEGREE = math.radians(1.0)


@pytest.mark.nightly("MuJoCo's public steps in Python: 14 s of CPU")
@pytest.mark.parametrize("terms", [{}, TERMS])
def test_the_public_steps_have_the_same_bits(terms: dict[str, float]) -> None:
    robot = robot_with("yaw16", **terms, backlash_rad=DEGREE)
    bodies = [MujocoPlant(robot, FLAT) for _ in range(2)]
    bodies[1].steps = PublicSteps(bodies[1].mechanics)
    for body in bodies:
        waved(body, robot)
    np.testing.assert_array_equal(bodies[0].qpos, bodies[1].qpos)
    np.testing.assert_array_equal(bodies[0].mechanics.rotor, bodies[1].mechanics.rotor)


def test_a_rotor_stays_in_its_gap_and_crosses_it() -> None:
    robot = robot_with("yaw16", backlash_rad=DEGREE)
    body, drive = MujocoPlant(robot, FLAT), drive_of(robot)
    phase, gaps = np.arange(robot.joint_count) / 2.0, []
    for k in range(200):
        drive.goal_rad[:] = 0.4 * np.sin(0.06 * k - phase)
        body.advance(0.01 * (k + 1), drive)
        gaps.append(body.mechanics.rotor[GAP].copy())
    assert np.abs(gaps).max() == pytest.approx(0.5 * DEGREE, abs=1e-15)
    assert (np.max(gaps, axis=0) - np.min(gaps, axis=0)).min() > 0.99 * DEGREE
    touching = body.mechanics.rotor[SIDE] != 0.0
    armature = body.mechanics.model.dof_armature[6:]
    assert touching.any()
    np.testing.assert_array_equal(armature[touching], robot.servo.armature_kg_m2)
    assert (armature[~touching] < 0.1 * robot.servo.armature_kg_m2).all()


def test_a_lifted_tail_comes_down_by_half_the_backlash() -> None:
    """Without torque the gears hold the rotor; the weight presses the last joint to its tooth."""
    robot = robot_with("alternating16", dry_n_m=1.0, backlash_rad=3.0 * DEGREE)
    lifted = np.zeros(robot.joint_count)
    last = robot.pitch_joints[-1]
    lifted[last] = 0.3
    body = MujocoPlant(robot, FLAT)
    body.reset((0.0, 0.0), 0.0, lifted)
    start = body.position_rad[last]
    body.advance(1.5, drive_of(robot, on=0.0))
    moved = body.position_rad[last] - start
    assert abs(moved) == pytest.approx(1.5 * DEGREE, abs=0.1 * DEGREE)
    assert body.mechanics.rotor[SIDE, last] != 0.0


def test_without_backlash_its_state_is_never_touched() -> None:
    robot = robot_with("yaw16", **TERMS)
    body = MujocoPlant(robot, FLAT)
    waved(body, robot)
    assert not body.mechanics.rotor.any()
    np.testing.assert_array_equal(body.mechanics.model.dof_armature[6:], robot.servo.armature_kg_m2)
