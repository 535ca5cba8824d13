"""The film's skin: MuJoCo bends it as the skin says, on the links of any pose."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.animals.mesh.body_look import skin_look
from snakewalk.controller.animals.mesh.body_motion import from_poses, robot_skin
from snakewalk.controller.animals.mesh.body_skin import body_skin
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.run.results import check_look, film_look
from snakewalk.sim.rendering.looks import Scene, dressed_model


def header(track: str = "worm-like") -> Any:
    robot, world = load_robot("alternating16"), load_world("flat")
    run = load_run("flat-square").model_copy(update={"track": track})
    return SimpleNamespace(robot=robot, world=world, run=run)


def test_mujoco_draws_the_posed_skin() -> None:
    of = header()
    look = skin_look("snake", of)
    assert look is not None
    model = dressed_model(Scene(of.robot, of.world, None), look=look)
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, maxgeom=1000)
    rng = np.random.default_rng(1)
    turn = Rotation.from_rotvec([0.2, -0.3, 1.4]).as_quat(scalar_first=True)
    qpos = np.concatenate([[0.4, -0.2, 0.3], turn, rng.uniform(-0.6, 0.6, of.robot.joint_count)])
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    option, camera = mujoco.MjvOption(), mujoco.MjvCamera()
    mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    drawn = np.array(scene.skinvert).reshape(-1, 3)
    skin = robot_skin(body_skin("snake").skin, of.robot)
    motion = from_poses(of.robot, np.zeros(1), qpos[None])
    np.testing.assert_allclose(drawn, posed_m(spine_rig(skin, motion.bone_m), motion, 0), atol=2e-6)


def test_a_skin_stands_in_place_of_capsules_and_adds_no_mass() -> None:
    of = header()
    plain = dressed_model(Scene(of.robot, of.world, None))
    animal = dressed_model(Scene(of.robot, of.world, None), look=skin_look("snake", of))
    assert (plain.nskin, animal.nskin) == (0, 1)
    assert animal.ngeom < plain.ngeom
    assert animal.body_mass.sum() == pytest.approx(plain.body_mass.sum())
    shown = animal.tex("animal")
    texture = body_skin("snake").texture
    assert texture is not None
    assert (shown.height[0], shown.width[0]) == texture.shape[:2]
    start = int(shown.adr[0])
    stored = animal.tex_data[start : start + texture.size].reshape(texture.shape)
    np.testing.assert_array_equal(stored, texture)


def test_the_animal_is_the_one_that_was_captured(tmp_path: Path) -> None:
    s = np.linspace(0.0, 1.0, 30)
    points = np.stack([np.stack([-50.0 * s, np.sin(3 * s)], axis=1)] * 3)
    np.savez(tmp_path / "t.npz", points=points, radius_m=np.full((3, 30), 4.0))
    thick = skin_look("animal", header(str(tmp_path / "t.npz")))
    plain = skin_look("animal", header())
    assert thick is not None
    assert plain is not None
    assert np.ptp(thick.vertices_m[:, 1]) > 2.0 * np.ptp(plain.vertices_m[:, 1])
    assert film_look("servos", header()) is None


def test_the_skin_rests_where_the_belly_does_and_at_its_axis_in_water() -> None:
    dry, wet = header(), header()
    wet.world = load_world("pool")
    looks = [skin_look("snake", of) for of in (dry, wet)]
    over, axis = [
        (float(look.rest_m[0, 2] - look.vertices_m[:, 2].min()), float(look.rest_m[0, 2]))
        for look in looks
        if look is not None
    ]
    assert over[0] == pytest.approx(dry.robot.body_radius_m)
    assert axis[1] == pytest.approx(0.0)


def test_a_look_that_is_none_is_refused_before_a_run() -> None:
    check_look("servos")
    check_look("animal")
    with pytest.raises(InputError, match=r"unicorn: no such body; shipped skins are carp"):
        check_look("unicorn")
