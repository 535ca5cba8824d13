"""A body whose tail follows servos that are measured elsewhere."""

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.split_plant import SplitPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, motors_of

ROBOT = RobotConfig(name="six", joint_axes="yyyyyy")
REAL = (1, 4, 5)
STEP_S = 0.02


def a_body() -> tuple[MujocoPlant, SplitPlant]:
    plant = MujocoPlant(ROBOT, WorldConfig(name="flat"))
    return plant, SplitPlant(plant, motors_of(ROBOT), REAL)


def measured(time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """A wave of 0.5 rad and 2 rad/s along all joints."""
    phase = 4.0 * time_s - 0.6 * np.arange(ROBOT.joint_count)
    return 0.5 * np.sin(phase), 2.0 * np.cos(phase)


def test_shafts_follow_what_is_measured_and_the_others_do_not() -> None:
    plant, body = a_body()
    drive = make_drive([MOTORS["XM430-W350"]] * 3, 12.0)
    off_rad = []
    for k in range(200):
        now_s = k * STEP_S
        body.follow(np.full(6, now_s), *measured(now_s))
        body.advance(now_s + STEP_S, drive)
        off_rad.append(plant.position_rad[list(REAL)] - measured(body.time_s)[0][list(REAL)])
    assert np.sqrt(np.mean(np.square(off_rad[10:]))) < 0.02
    assert np.abs(off_rad[10:]).max() < 0.06
    assert body.position_rad == pytest.approx(plant.position_rad[[0, 2, 3]])
    assert not np.allclose(
        plant.position_rad[[0, 2, 3]], measured(body.time_s)[0][[0, 2, 3]], atol=0.1
    )


def test_the_simulated_servos_are_driven_as_in_a_whole_body() -> None:
    """With what the others do in a body of simulated servos measured, all is as in that body."""
    whole = MujocoPlant(ROBOT, WorldConfig(name="flat"))
    all_of_it = make_drive([MOTORS["XM430-W350"]] * 6, 12.0)
    _, body = a_body()
    some = make_drive([MOTORS["XM430-W350"]] * 3, 12.0)
    for drive in (all_of_it, some):
        drive.torque_on[:], drive.p_gain_per_rad[:] = 1.0, 5.0
    for k in range(150):
        now_s = k * STEP_S
        goal_rad = measured(now_s)[0]
        all_of_it.goal_rad[:], some.goal_rad[:] = goal_rad, goal_rad[[0, 2, 3]]
        body.follow(np.full(6, now_s), whole.position_rad.copy(), whole.velocity_rad_s.copy())
        whole.advance(now_s + STEP_S, all_of_it)
        body.advance(now_s + STEP_S, some)
    assert body.position_rad == pytest.approx(whole.position_rad[[0, 2, 3]], abs=0.01)
    assert some.current_a == pytest.approx(all_of_it.current_a[[0, 2, 3]], abs=0.1)
    assert some.work_j == pytest.approx(all_of_it.work_j[[0, 2, 3]], rel=0.1)


def test_shafts_are_limp_until_they_are_measured() -> None:
    plant, body = a_body()
    drive = make_drive([MOTORS["XM430-W350"]] * 3, 12.0)
    body.advance(0.1, drive)
    nowhere = np.full(6, np.nan)
    body.follow(np.full(6, 0.1), nowhere, nowhere)
    body.advance(0.2, drive)
    assert plant.position_rad == pytest.approx(np.zeros(6), abs=1e-6)
