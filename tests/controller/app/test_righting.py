"""A body put on its back turns home while it walks, on the simulated servos."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.controller.app.runs.execute import execute
from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.metrics.ground_contact import roll_rad
from snakewalk.controller.runlog.reader import read_log
from snakewalk.sim.physics.plant import MujocoPlant


@pytest.mark.parametrize("seed", [0, 1])
def test_a_body_on_its_back_turns_home_on_hills(
    seed: int, tmp_path: Path, mocker: MockerFixture
) -> None:
    reset = MujocoPlant.reset

    def on_its_back(plant: MujocoPlant, *place: object) -> None:
        reset(plant, *place)
        data, half_turn = plant.mechanics.data, np.array([0.0, 1.0, 0.0, 0.0])
        mujoco.mju_mulQuat(data.qpos[3:7], data.qpos[3:7].copy(), half_turn)
        mujoco.mj_forward(plant.mechanics.model, data)

    mocker.patch.object(MujocoPlant, "reset", on_its_back)
    prepared = prepare_walk("jacksboro-traverse", seed=seed, time_limit_s=20.0)
    execute(prepared, tmp_path)
    pose = read_log(tmp_path / "log.mcap").pose
    roll = np.abs(roll_rad(pose.rotation))
    assert roll[0] > 2.5
    assert roll[pose.time_s > 18.0].max() < 1.2
