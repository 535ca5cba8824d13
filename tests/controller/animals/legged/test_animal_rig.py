"""The body on its bones: parts where the bones are, and a file that any viewer plays."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.animals.legged.animal_film import AnimalBody
from snakewalk.controller.animals.legged.animal_rig import animal_bones
from snakewalk.controller.animals.legged.animal_synthesis import ANIMALS, read_animal
from snakewalk.controller.animals.legged.motion_transformation import AnimalMotion, transformed
from snakewalk.controller.animals.legged.prototype import SEGMENTS, prototype
from snakewalk.controller.animals.mesh.rig import posed_m
from snakewalk.controller.animals.mesh.skin_file import Y_UP, write_skin
from snakewalk.controller.terrain.path import SplinePath
from tests.oracles.gltf_player import GltfPlayer

WAY = SplinePath(np.array([[0.0, 0.0], [1.0, 0.2], [2.0, 1.0]]))


def moved(name: str) -> AnimalMotion:
    """Half a cycle on a bend."""
    animal = read_animal(name)
    return transformed(
        prototype(animal, np.linspace(0.3, 0.8, 7) * animal.cycle_s), animal, WAY, None
    )


@pytest.mark.parametrize("name", ANIMALS)
def test_legs_of_the_mesh_end_at_the_feet(name: str) -> None:
    animal, motion = read_animal(name), moved(name)
    rig, bones = AnimalBody.of(animal).rig, animal_bones(animal, motion)
    assert len(rig.rest_m) == bones.front_m.shape[1] == len(bones.bone_m) == len(rig.parent)
    for frame in (0, 3):
        corners = posed_m(rig, bones, frame)
        for k in range(4):
            thick = animal.length_m * animal.leg_pairs[k // 2].thick
            lower = (rig.held.bones[:, 1] == SEGMENTS + 2 * k + 1) & (rig.held.shares[:, 1] == 1.0)
            far = np.linalg.norm(corners[lower] - motion.end_m[frame, k], axis=-1)
            assert far.min() == pytest.approx(0.55 * thick, rel=1e-6)  # the round end's radius
    turned = np.einsum("tkji,tkjl->tkil", bones.rotation, bones.rotation)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-12)


def test_a_goat_has_the_papers_eleven_parts() -> None:
    goat = read_animal("goat")
    # body and tail are one skin here; two horns, two ears, a beard, four legs
    assert len(goat.all_ornaments) + 2 * len(goat.leg_pairs) + 2 == 11


@pytest.mark.parametrize("name", ANIMALS)
def test_the_animated_file_moves_as_the_bones_do(name: str, tmp_path: Path) -> None:
    animal = read_animal(name)
    body, bones = AnimalBody.of(animal), animal_bones(animal, moved(name))
    file = tmp_path / "a.glb"
    write_skin(file, body.rig, bones, body.texture, name)
    player = GltfPlayer.read(file)
    for frame in (0, 4):
        np.testing.assert_allclose(
            player.corners(frame) @ Y_UP, posed_m(body.rig, bones, frame), atol=2e-5
        )
