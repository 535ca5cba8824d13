"""The body on its bones: parts where the bones are, and a file that any viewer plays."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.animals.legged.animal_film import AnimalBody, film_rate
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
def test_bones_of_the_legs_lie_between_their_joints(name: str) -> None:
    animal, motion = read_animal(name), moved(name)
    rig, bones = AnimalBody.of(animal).rig, animal_bones(animal, motion)
    assert len(rig.rest_m) == bones.front_m.shape[1] == len(bones.bone_m) == len(rig.parent)
    assert len(set(rig.names)) == len(rig.names) == len(rig.parent)
    assert {"spine_03", "upper_arm_right", "thigh_left", "hind_foot_left"} <= set(rig.names)
    thigh = rig.names.index("thigh_left")
    assert rig.names[rig.parent[thigh + 1]] == "thigh_left"
    first = SEGMENTS
    for k, joints in enumerate(motion.joints_m):
        parts = len(animal.leg_pairs[k // 2].segments)
        own = slice(first, first + parts)
        ends = bones.front_m[:, own] - bones.bone_m[own, None] * bones.rotation[:, own, :, 0]
        np.testing.assert_allclose(bones.front_m[:, own], joints[:, :-1], atol=1e-12)
        np.testing.assert_allclose(ends, joints[:, 1:], atol=1e-9)
        first += parts
    turned = np.einsum("tkji,tkjl->tkil", bones.rotation, bones.rotation)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-12)


@pytest.mark.parametrize("name", ANIMALS)
def test_hooves_and_toes_lie_on_the_ground_and_not_in_it(name: str) -> None:
    """Of a foot that stands: the lowest corner is within 1 % of a leg's length of the ground."""
    animal = read_animal(name)
    line = SplinePath(np.array([[0.0, 0.0], [3.0, 0.0], [6.0, 0.0]]))
    motion = transformed(
        prototype(animal, np.linspace(1, 2, 9) * animal.cycle_s), animal, line, None
    )
    rig, bones = AnimalBody.of(animal).rig, animal_bones(animal, motion)
    leg_m = animal.length_m * sum(animal.leg_pairs[1].segments)
    first, standing = SEGMENTS, 0
    for k in range(4):
        first += len(animal.leg_pairs[k // 2].segments)
        foot = (rig.held.bones[:, 1] == first - 1) & (rig.held.shares[:, 1] > 0.99)
        for frame in range(len(motion.time_s)):
            lowest = posed_m(rig, bones, frame)[foot, 2].min()
            assert lowest > -0.01 * leg_m
            if motion.on_ground[frame, k]:
                assert lowest < 0.01 * leg_m
                standing += 1
    assert standing > 18


@pytest.mark.parametrize("name", ANIMALS)
def test_the_skin_of_a_leg_is_one_piece(name: str) -> None:
    """Corners at a joint belong to both bones, and the shares of a corner sum to 1."""
    rig = AnimalBody.of(read_animal(name)).rig
    np.testing.assert_allclose(rig.held.shares.sum(axis=1), 1.0)
    assert rig.held.shares.min() >= 0.0
    pair = read_animal(name).leg_pairs[0]
    for joint in range(1, len(pair.segments)):
        before = (rig.held.bones[:, 1] == SEGMENTS + joint) & (rig.held.shares[:, 0] > 0.4)
        assert before.sum() >= 8  # at least half a ring


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


@pytest.mark.parametrize(("cycle_s", "frames_per_second"), [(1.2, 30), (0.26, 60), (0.1, 120)])
def test_a_film_shows_each_cycle_in_a_dozen_frames(cycle_s: float, frames_per_second: int) -> None:
    assert film_rate(cycle_s) == frames_per_second
    assert film_rate(cycle_s) * cycle_s >= 12.0
