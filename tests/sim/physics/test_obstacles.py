"""Pegs and walls: where they stand, what they bear, what starts inside them, what pushes off."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import CorridorObstacle, FrictionConfig, PegsObstacle, WorldConfig
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive

ROBOT = load_robot("yaw16")
STRAIGHT = np.zeros(ROBOT.joint_count)


def world(obstacle: PegsObstacle | CorridorObstacle | None) -> WorldConfig:
    return WorldConfig(name="test", obstacle=obstacle)


@pytest.mark.parametrize("pattern", ["square", "hexagonal"])
def test_pegs_of_a_board_are_a_spacing_apart_about_its_middle(pattern: str) -> None:
    board = PegsObstacle(spacing_m=0.3, rows=4, row_pegs=5, pattern=pattern, at_m=(1.0, -2.0))  # type: ignore[arg-type]
    places = np.array(board.places_m())
    np.testing.assert_allclose(places.mean(axis=0), board.at_m, atol=1e-12)
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1) + 9.0 * np.eye(len(places))
    np.testing.assert_allclose(apart.min(axis=1), 0.3, atol=1e-12)
    near = (apart < 0.3 + 1e-9).sum(axis=1).max()
    assert near == (6 if pattern == "hexagonal" else 4)


def test_the_model_has_a_cylinder_for_each_peg_and_a_box_for_each_wall() -> None:
    board = PegsObstacle(spacing_m=0.4, rows=3, row_pegs=2, at_m=(3.0, 0.0))
    model = MujocoPlant(ROBOT, world(board)).mechanics.model
    names = [model.geom(k).name for k in range(model.ngeom)]
    pegs = [k for k, name in enumerate(names) if name.startswith("obstacle")]
    np.testing.assert_allclose(model.geom_pos[pegs, :2], board.places_m(), atol=1e-12)
    assert (model.geom_type[pegs] == mujoco.mjtGeom.mjGEOM_CYLINDER).all()
    way = MujocoPlant(ROBOT, world(CorridorObstacle(width_m=0.5))).mechanics.model
    inner = [way.geom("obstacle0"), way.geom("obstacle1")]
    faces = [wall.pos[1] - np.sign(wall.pos[1]) * wall.size[1] for wall in inner]
    np.testing.assert_allclose(faces, [0.25, -0.25], atol=1e-12)


def test_a_body_that_would_start_inside_a_peg_is_refused_with_the_place() -> None:
    board = PegsObstacle(spacing_m=0.3, rows=1, row_pegs=1, pattern="square", at_m=(-0.2, 0.02))
    plant = MujocoPlant(ROBOT, world(board))
    with pytest.raises(InputError, match=r"link 2 would start .* \(-0.20, 0.02\): move start_m"):
        plant.reset((0.0, 0.0), 0.0, STRAIGHT)
    plant.reset((0.0, 0.3), 0.0, STRAIGHT)
    assert plant.contact_count > 0


def test_a_wall_stops_a_body_that_slides_into_it() -> None:
    """Sideways at 0.3 m/s over a slick floor, with walls 20 mm beside the skin and without."""
    slick = FrictionConfig(along=0.1, across=0.1)
    farthest_m = []
    for wall in (None, CorridorObstacle(width_m=0.1, friction=0.0)):
        made = world(wall).model_copy(update={"friction": slick})
        plant = MujocoPlant(ROBOT, made)
        plant.reset((0.0, 0.0), 0.0, STRAIGHT)
        data = plant.mechanics.data
        data.qvel[1] = 0.3
        mujoco.mj_forward(plant.mechanics.model, data)
        plant.mechanics.start_at_rest()
        drive = make_drive([MOTORS["XM430-W350"]] * ROBOT.joint_count, 12.0)
        drive.torque_on[:] = 1.0
        drive.p_gain_per_rad[:] = 5.0
        farthest = 0.0
        for k in range(1, 60):
            plant.advance(0.01 * k, drive)
            farthest = max(farthest, float(plant.link_positions_m[:, 1].max()))
        farthest_m.append(farthest)
    assert farthest_m[0] > 0.04
    assert farthest_m[1] == pytest.approx(0.02, abs=0.003)


def test_the_shipped_worlds_let_their_gaits_start() -> None:
    for name in ("pegs-undulation", "corridor-undulation"):
        prepared = prepare_gait(name)
        assert prepared.run.compliance is not None
        plant = MujocoPlant(prepared.robot, load_world(prepared.run.world))
        pose = prepared.initial_pose()
        for aside_m in (-0.12, 0.0, 0.12):
            plant.reset((aside_m / 2, aside_m), pose.heading_rad, pose.joint_rad)
