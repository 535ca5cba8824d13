"""A body put on its back turns home while it walks, on the simulated servos."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.controller.metrics.ground_contact import roll_rad
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.tiers import slow_except

SECONDS = 20.0


@pytest.mark.slow_cases(1, "20 s of a walk each: 7 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("pose", slow_except(["imu"], ["simulator", "imu"]))
def test_a_body_on_its_back_turns_home_on_hills_and_says_so(
    pose: str, tmp_path: Path, mocker: MockerFixture
) -> None:
    """Where it lies in a hollow it takes longer. Upright in time: 20 of 20 seeds, with ``imu`` 18.

    With ``imu`` nothing but the device on the bus tells the walk how the body lies.
    """
    reset = MujocoPlant.reset

    def on_its_back(plant: MujocoPlant, *place: object) -> None:
        reset(plant, *place)
        data, half_turn = plant.mechanics.data, np.array([0.0, 1.0, 0.0, 0.0])
        mujoco.mju_mulQuat(data.qpos[3:7], data.qpos[3:7].copy(), half_turn)
        mujoco.mj_forward(plant.mechanics.model, data)

    mocker.patch.object(MujocoPlant, "reset", on_its_back)
    rolls: list[tuple[float, float]] = []
    head_pose = MujocoPlant.head_pose

    def watched(plant: MujocoPlant) -> BodyPose:
        true = head_pose(plant)
        rolls.append((true.time_s, abs(float(roll_rad(true.rotation[None])[0]))))
        return true

    mocker.patch.object(MujocoPlant, "head_pose", watched)
    robot, run = "alternating16-imu", "jacksboro-traverse"
    prepared = prepare_walk(run, seed=1, robot=robot, pose=pose, time_limit_s=SECONDS)
    record = run_robot(RunRequest(prepared, tmp_path / "run")).record
    time_s, roll = np.array(rolls).T
    assert roll[0] > 2.5
    assert len(record.imu.time_s) == len(record.cycle.time_s)
    assert roll[time_s > SECONDS - 2.0].max() < 1.2
    said = [event.text for event in record.events if event.kind == "roll"]
    assert said[0].startswith("rolled over")
    assert said[-1] == "upright again"
