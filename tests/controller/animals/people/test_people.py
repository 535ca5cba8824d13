"""People: feet by [GC] Eq. 9 and 10, legs from the feet, the PDE skin on the bones, the files."""

import json
from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh
from scipy.spatial import cKDTree

from snakewalk.controller.animals.mesh.patches import Tube
from snakewalk.controller.animals.mesh.rig import posed_m
from snakewalk.controller.animals.people.body_curves import AROUND
from snakewalk.controller.animals.people.cycle import (
    FRAMES,
    GAITS,
    RUN,
    WALK,
    FootParameters,
    PersonMotion,
    animate,
    feet,
)
from snakewalk.controller.animals.people.feet_law import FeetLaw
from snakewalk.controller.animals.people.skeleton import INDEX
from snakewalk.controller.animals.people.surface import Person
from snakewalk.controller.animals.people.worn_mesh import worn_mesh
from snakewalk.controller.images.mesh import Mesh
from tests.helpers.command import snakewalk
from tests.oracles.gltf_player import GltfPlayer

PHASE = np.arange(400) / 400
H, L = 0.1, 0.3
GIVEN = FootParameters(
    height_m=H, length_m=L, duty=0.6, right_height_m=0.02, right_initial_m=0.03,
    right_length_m=-0.05,
)  # fmt: skip
PLAIN = FootParameters(height_m=H, length_m=L, duty=0.6)


@pytest.fixture(scope="module")
def person() -> Person:
    return Person.of(1.75, 1.0)


@pytest.fixture(scope="module")
def walk(person: Person) -> PersonMotion:
    return animate(person.skeleton, WALK, in_place=True)


def test_printed_feet_are_equations_9_and_10_with_their_parameters() -> None:
    t_y, t_z = np.sin(2.0 * np.pi * PHASE), np.cos(2.0 * np.pi * PHASE)
    found = feet(FeetLaw.PRINTED, GIVEN, PHASE)
    np.testing.assert_allclose(found.height_m[:, 1], t_y * (H + 0.02) + 0.03, atol=1e-12)
    np.testing.assert_allclose(found.ahead_m[:, 1], -t_z * (L - 0.05), atol=1e-12)
    np.testing.assert_allclose(found.height_m[:, 0], t_y * H, atol=1e-12)
    np.testing.assert_allclose(found.ahead_m[:, 0], t_z * L, atol=1e-12)


def test_printed_feet_are_below_the_ground_and_in_the_air_together() -> None:
    printed = feet(FeetLaw.PRINTED, PLAIN, PHASE)
    assert printed.height_m.min() == pytest.approx(-H)
    assert (printed.height_m < -1e-12).mean() == pytest.approx(0.5, abs=0.01)
    both = (printed.height_m > 1e-12).all(axis=1)
    assert both.mean() == pytest.approx(0.5, abs=0.01)
    forward = np.gradient(printed.ahead_m[:, 0])
    assert (forward[both] <= 1e-12).all()  # the left foot is lifted while it goes back
    ours = feet(FeetLaw.PHASES, PLAIN, PHASE)
    assert ours.height_m.min() == 0.0
    assert not (ours.height_m > 1e-12).all(axis=1).any()
    for k in range(2):
        lifted = ours.height_m[:, k] > 1e-3
        assert (np.gradient(ours.ahead_m[:, k])[lifted] > 0.0).all()
    np.testing.assert_allclose(ours.ahead_m, printed.ahead_m)


@pytest.mark.parametrize("law", [FeetLaw.PHASES, FeetLaw.PLANTED])
def test_the_feet_are_half_a_cycle_apart(law: FeetLaw) -> None:
    found = feet(law, PLAIN, PHASE)
    for ways in (found.ahead_m, found.height_m):
        np.testing.assert_allclose(ways[:, 1], np.roll(ways[:, 0], 200), atol=1e-12)


@pytest.mark.parametrize(("gait", "both"), [(WALK, "ground"), (RUN, "air")])
def test_planted_feet_keep_their_place_and_a_run_leaves_the_ground(gait, both, person) -> None:  # type: ignore[no-untyped-def]
    made = animate(person.skeleton, gait, cycles=2, frames=100)
    place = made.feet.ahead_m + (made.speed_m_s * made.bones.time_s)[:, None]
    for k in range(2):
        on = np.flatnonzero(made.feet.on_ground[:, k])
        for step in np.split(on, np.flatnonzero(np.diff(on) > 1) + 1):
            assert np.ptp(place[step, k]) < 1e-9
        assert made.feet.height_m[on, k].max() == 0.0
    count = made.feet.on_ground.sum(axis=1)
    assert (count == (2 if both == "ground" else 0)).any()
    assert not (count == (0 if both == "ground" else 2)).any()


@pytest.mark.parametrize("gait", list(GAITS))
@pytest.mark.parametrize("law", list(FeetLaw))
def test_legs_keep_their_lengths_and_reach_the_feet(
    gait: str, law: FeetLaw, person: Person
) -> None:
    made = animate(person.skeleton, GAITS[gait], law)
    front, size = made.bones.front_m, person.skeleton.length_m
    for k, side in enumerate(("left", "right")):
        thigh, shank, foot = (INDEX[f"{side} {part}"] for part in ("thigh", "shank", "foot"))
        np.testing.assert_allclose(front[:, foot], made.ankle_m[:, k], atol=1e-12)
        for upper, lower in ((thigh, shank), (shank, foot)):
            long_m = np.linalg.norm(front[:, upper] - front[:, lower], axis=1)
            np.testing.assert_allclose(long_m, size[upper], rtol=1e-9)
        # a knee bends forward only
        line = front[:, foot] - front[:, thigh]
        bend = front[:, shank] - front[:, thigh]
        assert (bend[:, 0] * line[:, 2] - bend[:, 2] * line[:, 0]).max() < 1e-9
    turns = made.bones.rotation
    np.testing.assert_allclose(
        np.swapaxes(turns, -1, -2) @ turns, np.broadcast_to(np.eye(3), turns.shape), atol=1e-9
    )


KNEE_OF_A_WALK = ((0.0, 5.0), (0.12, 17.0), (0.25, 11.0), (0.40, 5.0), (0.50, 11.0))
"""Share of a cycle and flexion in degrees (Perry, Gait Analysis: knee, free walking), in stance."""


def test_the_knees_of_a_walk_bend_as_published(person: Person) -> None:
    made = animate(person.skeleton, GAITS["walk"], frames=100)
    for side, first in (("left", 0), ("right", 1)):
        hip, knee, ankle = (
            made.bones.front_m[:-1, INDEX[f"{side} {part}"]] for part in ("thigh", "shank", "foot")
        )
        thigh, shank = (
            each / np.linalg.norm(each, axis=1)[:, None] for each in (knee - hip, ankle - knee)
        )
        bend = np.degrees(np.arccos((thigh * shank).sum(axis=1)))
        at = made.feet.at[:-1, first]
        order = np.argsort(at)
        for share, published in KNEE_OF_A_WALK:
            assert np.interp(share, at[order], bend[order]) == pytest.approx(published, abs=7.0)
        assert 50.0 < bend.max() < 65.0  # in the air; published: 60
        # the trailing leg is behind the hip before the other foot comes down
        before = np.argmin(np.abs(at - 0.48))
        assert np.degrees(np.arctan2(thigh[before, 0], -thigh[before, 2])) < -10.0


@pytest.mark.parametrize("gait", list(GAITS))
def test_the_sole_stays_above_the_ground(gait: str, person: Person) -> None:
    made = animate(person.skeleton, GAITS[gait])
    low = [posed_m(person.rig, made.bones, k)[:, 2].min() for k in range(FRAMES)]
    assert min(low) > -0.0025 * person.skeleton.stature_m
    assert (np.array(low) < 0.003 * person.skeleton.stature_m).any()


def test_arms_swing_against_the_legs(walk: PersonMotion) -> None:
    front = walk.bones.front_m
    for side, other in (("left", "right"), ("right", "left")):
        hand = front[:, INDEX[f"{side} hand"], 0] - front[:, INDEX[f"{side} upper arm"], 0]
        foot = front[:, INDEX[f"{other} foot"], 0]
        assert np.corrcoef(hand, foot)[0, 1] > 0.9


def test_surfaces_meet_every_boundary_curve_in_every_pose(
    person: Person, walk: PersonMotion
) -> None:
    bones, rest = walk.bones, person.skeleton.joint_m
    solved = person.solved_m(bones.front_m[5], bones.rotation[5]).reshape(-1, AROUND, 3)
    played = posed_m(person.rig, bones, 5).reshape(-1, AROUND, 3)
    row = 0
    for part in person.parts:
        moved = part.moved_m(bones.front_m[5], bones.rotation[5], rest)
        rows = 3 * (len(moved) - 1) + 1
        np.testing.assert_allclose(solved[row : row + rows : 3], moved, atol=1e-9)
        # the played skin carries each curve with the same bones
        np.testing.assert_allclose(played[row : row + rows : 3], moved, atol=1e-9)
        row += rows
    assert row == len(solved)
    assert np.linalg.norm(played - solved, axis=-1).max() < 0.02 * person.skeleton.stature_m


def test_limbs_begin_on_the_trunk(person: Person) -> None:
    trunk = person.parts[0]
    tube = Tube.through(trunk.curves_m, trunk.stations)
    around = np.arange(256) * 2.0 * np.pi / 256
    surface = cKDTree(tube.points_m(tube.rows(20), around).reshape(-1, 3))
    for part in person.parts[1:5]:
        assert surface.query(part.curves_m[0])[0].max() < 0.004
        assert surface.query(part.curves_m[-2])[0].min() > 0.1


def test_the_file_plays_the_same_cycle_and_closes(
    person: Person, walk: PersonMotion, tmp_path: Path
) -> None:
    done = snakewalk("animal", "people", "walk", "-o", str(tmp_path / "a.glb"), "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["feet_slide_m"] == 0.0
    assert facts["bones"] == 19
    names = [node.name for node in pygltflib.GLTF2().load(str(tmp_path / "a.glb")).nodes]
    assert len(set(names)) == len(names) == facts["bones"] + 2
    assert {"thigh_left", "upper_arm_right", "pelvis"} <= set(names)
    player = GltfPlayer.read(tmp_path / "a.glb")
    np.testing.assert_allclose(player.time_s, walk.bones.time_s, atol=1e-6)
    to_world = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    for frame in (0, 7, 17):
        np.testing.assert_allclose(
            player.corners(frame) @ to_world, posed_m(person.rig, walk.bones, frame), atol=1e-5
        )
    np.testing.assert_allclose(player.corners(FRAMES), player.corners(0), atol=1e-5)


def test_another_mesh_moves_with_the_person(person: Person, walk: PersonMotion) -> None:
    rest = person.rig.mesh
    out = rest.vertices + 0.01 * rest.normals  # clothes, in another size and place
    fine = trimesh.Trimesh(2.0 * out + [3.0, 1.0, 5.0], rest.faces, process=False).subdivide()
    count = len(fine.vertices)
    mesh = Mesh(np.array(fine.vertices), np.array(fine.vertex_normals), np.zeros((count, 2)),
                np.array(fine.faces))  # fmt: skip
    worn = worn_mesh(person, mesh)
    assert np.ptp(worn.mesh.vertices[:, 2]) == pytest.approx(1.75)
    moved = posed_m(worn, walk.bones, 4)
    skin = posed_m(person.rig, walk.bones, 4)
    off = np.linalg.norm(moved[: len(skin)] - skin, axis=1)
    assert np.median(off) < 0.02
    assert off.max() < 0.06


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("hop",), "'hop' is not one of 'walk', 'run'"),
        (("walk", "-o", "a.obj"), "a person who moves ends in .glb"),
        (("walk", "--film", "a.avi"), "ends in .mp4"),
        (("walk", "--mesh", "none.obj"), "no such file"),
    ],
)
def test_bad_input_is_refused(words: tuple[str, ...], fault: str) -> None:
    done = snakewalk("animal", "people", *words)
    assert done.returncode == 2
    assert fault in " ".join(done.stderr.split())
