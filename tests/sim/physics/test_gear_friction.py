"""Friction in the gears of a body: what it holds, what it loses, and that loops agree about it."""

from typing import Any

import mujoco
import numpy as np
import pytest

from snakewalk.config.loader import load_robot, load_world, with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import (
    Gearbox,
    friction_n_m,
    gears_of,
    make_drive,
    motors_of,
    p_gain_per_rad,
)
from tests.oracles.numpy_steps import numpy_plant

FLAT = load_world("flat")
TERMS = {
    **{"dry_n_m": 0.02, "stribeck_n_m": 0.01, "stribeck_rad_s": 0.2, "by_motor": 0.3},
    **{"by_load": 0.1, "by_motor_slow": 0.05, "by_load_slow": 0.1, "stribeck_exponent": 1.3},
    **{"by_motor_square": 0.1, "by_load_square": 0.2},
}


def robot_with(name: str, **motor: Any) -> RobotConfig:
    robot = load_robot(name)
    return with_keys(robot, {"servo": robot.servo.model_dump() | {"motor": motor}}, "mine")


def drive_of(robot: RobotConfig, on: float = 1.0) -> ServoDrive:
    motors = motors_of(robot)
    drive = make_drive(motors, robot.servo.supply_v)
    drive.torque_on[:] = on
    drive.p_gain_per_rad[:] = [
        float(p_gain_per_rad(gain, motor))
        for gain, motor in zip(robot.position_p_gains, motors, strict=True)
    ]
    return drive


def waved(body: MujocoPlant, robot: RobotConfig) -> ServoDrive:
    drive = drive_of(robot)
    phase = np.arange(robot.joint_count) / 2.0
    for k in range(10):
        drive.goal_rad[:] = 0.4 * np.sin(0.5 * k - phase)
        body.advance(0.05 * (k + 1), drive)
    return drive


@pytest.mark.slow
def test_loops_agree_and_what_the_motors_do_is_somewhere() -> None:
    robot = robot_with("yaw16", **TERMS)
    bodies = [make(robot, FLAT) for make in (MujocoPlant, numpy_plant)]
    drives = [waved(body, robot) for body in bodies]
    compiled, plain = (body.mechanics.data.qpos.copy() for body in bodies)
    np.testing.assert_allclose(compiled, plain, atol=1e-6)
    np.testing.assert_allclose(bodies[0].mechanics.totals, bodies[1].mechanics.totals, rtol=1e-4)
    bare = robot_with("yaw16")
    free = MujocoPlant(bare, FLAT)
    waved(free, bare)
    ground_j, _, gears_j = bodies[0].mechanics.totals
    assert gears_j > 2.0 * free.mechanics.totals[2]
    work_j = drives[0].work_j.sum()
    kinetic_j = 0.5 * _kinetic(bodies[0])
    assert abs(work_j - ground_j - gears_j - kinetic_j) < 0.05 * work_j


def _kinetic(body: MujocoPlant) -> float:
    m, d = body.mechanics.model, body.mechanics.data
    out = np.zeros(m.nv)
    mujoco.mj_mulM(m, d, out, d.qvel)
    return float(out @ d.qvel)


def test_a_lifted_head_stays_up_without_torque_where_the_gears_hold_it() -> None:
    """What they hold is the least of all: half as much and it comes down."""
    for share, stays in ((1.3, True), (0.6, False)):
        weight_n_m = 0.11 * 9.81 * 0.07 * (0.5 + 1.5) * np.cos(0.3)
        robot = robot_with("alternating16", dry_n_m=share * weight_n_m)
        lifted = np.zeros(robot.joint_count)
        second = robot.pitch_joints[0]
        lifted[second] = 0.3
        body = MujocoPlant(robot, FLAT)
        body.reset((0.0, 0.0), 0.0, lifted)
        start = body.position_rad.copy()
        body.advance(1.0, drive_of(robot, on=0.0))
        moved = np.abs(body.position_rad - start)[second]
        assert moved < 2e-3 if stays else moved > 0.05, (share, moved)


def test_friction_of_the_file_is_the_gearboxes() -> None:
    robot = robot_with("xl330-16", **TERMS)
    gear = Gearbox.columns(gears_of(robot)).rows()
    assert gear[0, 0] == robot.servo.armature_kg_m2
    assert gear[2, 0] == robot.servo.gear_drag_n_m_s
    by_hand = 0.02 + abs(0.1 * -0.2 - 0.3 * 0.3)
    slow = 0.01 + abs(0.1 * -0.2 - 0.05 * 0.3) + 0.2 * 0.2**2
    by_hand += slow * np.exp(-((0.1 / 0.2) ** 1.3))
    assert abs(friction_n_m(gear[:, 3], 0.1, 0.3, -0.2) - by_hand) < 1e-12
    assert not gears_of(load_robot("xl330-16"))[0].dry_n_m
