"""The file of a moving skin, played by the specification's text, is the motion in every frame."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.body_model import spindle
from snakewalk.controller.animals.mesh.cross_sections import ellipses
from snakewalk.controller.animals.mesh.patches import Tube
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin, pde_skin
from snakewalk.controller.animals.mesh.skin_file import Y_UP, write_skin
from snakewalk.controller.track.bone_motion import BoneMotion, from_points, thinned_points
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.track import Track
from tests.oracles.gltf_player import GltfPlayer

Floats = NDArray[np.float64]
TEXTURE = np.full((8, 16, 3), 90, np.uint8)


@pytest.fixture(scope="module")
def track() -> Track:
    return load_track("lamprey-like")


@pytest.fixture(scope="module")
def skin() -> Skin:
    found = ellipses(spindle(1.0), curves=12)
    return pde_skin(found, Tube.through(found.curves_m, found.stations))


def tumbling(frames: int = 30, bones: int = 9) -> BoneMotion:
    """Any motion: bones that turn about all axes, and slide."""
    rng = np.random.default_rng(2)
    turn = Rotation.from_rotvec(rng.normal(size=(frames * bones, 3)) * 2.0).as_matrix()
    return BoneMotion(
        np.arange(frames) * 0.04,
        rng.normal(size=(frames, bones, 3)),
        turn.reshape(frames, bones, 3, 3),
        rng.uniform(0.05, 0.2, size=bones),
    )


def test_every_frame_of_a_recording_is_read_back(track: Track, skin: Skin, tmp_path: Path) -> None:
    file = tmp_path / "snake.glb"
    length = float(track.length_m or 1.0)
    flat = thinned_points(track)
    spine = np.concatenate([flat, np.full((*flat.shape[:2], 1), 0.01)], axis=-1)
    motion = from_points(spine, track.time_s)
    write_skin(
        file, spine_rig(skin.sized(motion.length_m), motion.bone_m), motion, TEXTURE, "snake"
    )
    player = GltfPlayer.read(file)
    np.testing.assert_allclose(player.time_s, track.time_s, atol=1e-6)
    for frame in range(0, track.frames, 40):
        bones = player.bones(frame)
        at = bones[:, :3, 3] @ Y_UP
        np.testing.assert_allclose(at[:, :2], track.points[frame, :-1], atol=1e-5 * length)
        np.testing.assert_allclose(at[:, 2], 0.01, atol=1e-5 * length)
        forward = (np.swapaxes(bones[:, :3, :3], 1, 2) @ Y_UP)[:, 0]
        step = -np.diff(track.points[frame], axis=0)
        along = step / np.linalg.norm(step, axis=1)[:, None]
        np.testing.assert_allclose(forward[:, :2], along, atol=1e-4)


def test_the_played_skin_is_the_posed_skin_for_any_motion(skin: Skin, tmp_path: Path) -> None:
    motion = tumbling()
    sized = skin.sized(motion.length_m)
    write_skin(
        tmp_path / "a.glb", spine_rig(sized, motion.bone_m), motion, None, "any", both_sides=True
    )
    player = GltfPlayer.read(tmp_path / "a.glb")
    for frame in (0, 7, 29):
        np.testing.assert_allclose(
            player.corners(frame) @ Y_UP,
            posed_m(spine_rig(sized, motion.bone_m), motion, frame),
            atol=2e-5,
        )


def test_weights_sum_to_one_as_written_and_quaternions_take_the_short_way(
    skin: Skin, tmp_path: Path
) -> None:
    write_skin(
        tmp_path / "a.glb", spine_rig(skin.sized(1.0), tumbling().bone_m), tumbling(), None, "any"
    )
    player = GltfPlayer.read(tmp_path / "a.glb")
    held = player.attribute("WEIGHTS_0")
    np.testing.assert_allclose(held.sum(axis=1), 1.0, atol=2e-7)
    assert (player.attribute("JOINTS_0")[held == 0.0] == 0).all()
    for sampler in player.tree["animations"][0]["samplers"]:
        values = player.array(sampler["output"])
        if values.shape[1] == 4:
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
            assert (values[1:] * values[:-1]).sum(axis=1).min() >= -1e-6


def test_links_of_one_length_need_no_translation(skin: Skin, tmp_path: Path) -> None:
    line = np.stack([-np.linspace(0, 1, 9), np.zeros(9), np.zeros(9)], axis=1)
    motion = from_points(np.array([line, line + np.array([1.0, 0.0, 0.0])]), np.array([0.0, 1.0]))
    write_skin(tmp_path / "a.glb", spine_rig(skin.sized(1.0), motion.bone_m), motion, None, "any")
    channels = GltfPlayer.read(tmp_path / "a.glb").tree["animations"][0]["channels"]
    paths = [channel["target"]["path"] for channel in channels]
    assert paths.count("rotation") == 8
    assert paths.count("translation") == 1


def test_useless_motions_are_refused(skin: Skin, tmp_path: Path) -> None:
    motion = tumbling(1)
    with pytest.raises(InputError, match="two frames"):
        write_skin(tmp_path / "a.glb", spine_rig(skin, motion.bone_m), motion, None, "any")
    with pytest.raises(InputError, match="at most 256 bones, not 300"):
        write_skin(
            tmp_path / "a.glb",
            spine_rig(skin, tumbling(2, 300).bone_m),
            tumbling(2, 300),
            None,
            "any",
        )
    same = np.zeros((2, 5, 3))
    with pytest.raises(InputError, match="frame 0: points 0 and 1"):
        from_points(same, np.array([0.0, 1.0]))
    upright = np.stack([np.zeros(5), np.zeros(5), -np.arange(5.0)], axis=1)
    with pytest.raises(InputError, match="upright"):
        from_points(np.array([upright, upright]), np.array([0.0, 1.0]))


def validator() -> bool:
    """Whether node finds Khronos' validator: ``npm install gltf-validator`` with NODE_PATH."""
    node = shutil.which("node")
    asked = [node or "", "-e", "require.resolve('gltf-validator')"]
    return (
        node is not None and not subprocess.run(asked, capture_output=True, check=False).returncode
    )


@pytest.mark.skipif(not validator(), reason="node finds no gltf-validator")
@pytest.mark.parametrize("textured", [False, True])
def test_khronos_validator_finds_nothing(textured: bool, skin: Skin, tmp_path: Path) -> None:
    file = tmp_path / "a.glb"
    motion = tumbling()
    write_skin(
        file,
        spine_rig(skin.sized(motion.length_m), motion.bone_m),
        motion,
        TEXTURE if textured else None,
        "any",
    )
    script = (
        "require('gltf-validator').validateBytes(new Uint8Array(require('fs')"
        f".readFileSync('{file}'))).then(r => console.log(JSON.stringify(r.issues)))"
    )
    ran = subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True)
    found = json.loads(ran.stdout)
    assert found["numErrors"] + found["numWarnings"] + found["numInfos"] == 0, found["messages"]
