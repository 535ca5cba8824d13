"""``snakewalk animal body``: skins of shipped animals, meshes and recordings, all moved."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from snakewalk.config.animal import SkinConfig
from snakewalk.config.loader import load, locate, shipped
from snakewalk.controller.animals.fish.fish_film import swim
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.postures import save_postures
from snakewalk.controller.animals.mesh.body_skin import Cut, body_skin, fish_skin
from snakewalk.controller.animals.mesh.skin_file import Y_UP
from snakewalk.controller.images.mesh_files import read_mesh
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.drivers.types import BodyPose
from tests.helpers.command import snakewalk
from tests.oracles.gltf_player import GltfPlayer


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    run_robot(RunRequest(prepare_gait("sidewinding", seconds=1.0), folder))
    return folder


def made(*words: str) -> dict[str, object]:
    done = snakewalk("animal", "body", *words, "--json")
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def refused(*words: str) -> str:
    done = snakewalk("animal", "body", *words)
    assert done.returncode == 2
    assert done.stdout == ""
    return " ".join(done.stderr.split())


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("name", shipped("skins"))
def test_every_shipped_skin_is_closed_and_mirrored(name: str) -> None:
    skin = body_skin(name, Cut(curves=20)).skin
    solid = trimesh.Trimesh(skin.mesh.vertices, skin.mesh.faces, process=False)
    assert solid.volume > 0.0
    low, high = skin.mesh.vertices.min(axis=0), skin.mesh.vertices.max(axis=0)
    assert high[1] == pytest.approx(-low[1], rel=1e-3)
    tube = solid.split(only_watertight=False)[0]
    assert tube.is_watertight
    assert np.ptp(tube.vertices[:, 0]) == pytest.approx(1.0, abs=1e-3)


def test_a_gait_of_a_spine_moves_a_shipped_skin(tmp_path: Path) -> None:
    facts = made("dolphin", "--animate", "thunniform-dolphin", "-o", str(tmp_path / "d.glb"))
    assert (facts["frames"], facts["bones"], facts["fins"]) == (25, 100, 5)
    player = GltfPlayer.read(tmp_path / "d.glb")
    assert player.time_s[-1] == pytest.approx(1.0 / 1.3)
    np.testing.assert_allclose(player.corners(0), player.corners(24), atol=1e-5)
    assert np.ptp(player.bones(6)[:, 1, 3]) > 0.05  # up and down: y is up
    assert np.ptp(player.bones(6)[:, 2, 3]) < 1e-6


def test_a_matched_fish_swims_in_space_with_the_fins_of_its_build(tmp_path: Path) -> None:
    """[TH] 3.2.2: the model that was matched, and plates for fins whose places are not searched."""
    plain, swum, file = fish_model("carp", 120.0), swim(), tmp_path / "tench.npz"
    wide = np.linspace(1.3, 0.9, len(plain.half_width)) * plain.half_width
    fish = replace(plain, half_width=wide, half_height=0.8 * plain.half_height)
    save_postures(file, replace(swum, model=fish))
    facts = made(str(file), "--animate", str(file), "-o", str(tmp_path / "fish.glb"))
    assert (facts["frames"], facts["bones"], facts["fins"]) == (swum.frames, 100, 8)
    skin, carp = fish_skin(file), load(locate("skins", "carp"), SkinConfig)
    at = np.linspace(0.0, 1.0, len(wide))
    for section, before in zip(skin.sections, carp.sections, strict=True):
        assert section.half_width == pytest.approx(np.interp(section.at, at, wide))
        assert section.half_height == pytest.approx(0.8 * before.half_height)
    assert skin.fins[0].span == pytest.approx(0.8 * carp.fins[0].span)
    save_postures(tmp_path / "seen.npz", replace(swum, model=replace(fish, fin=0.15)))
    seen = next(one for one in fish_skin(tmp_path / "seen.npz").fins if one.paired)
    beside = seen.span * np.cos(np.radians(seen.around_deg))
    assert np.hypot(beside, seen.sweep) == pytest.approx(0.15)
    player = GltfPlayer.read(tmp_path / "fish.glb")
    assert swum.height is not None
    assert swum.pitch_rad is not None
    # the head is rigid: its tip lies 2/7 of the length ahead of the base, lifted by the pitch
    rise = swum.height + 2.0 / 7.0 * np.sin(swum.pitch_rad)
    tip = np.array([player.bones(k)[0, :3, 3] @ Y_UP for k in range(0, swum.frames, 30)])
    assert np.ptp(rise) > 0.2
    np.testing.assert_allclose(tip[:, 2] - tip[0, 2], (rise - rise[0])[::30], atol=2e-3)


def test_a_fish_without_sections_and_one_that_is_damaged_are_told(tmp_path: Path) -> None:
    save_postures(tmp_path / "lines.npz", swim())
    assert "expected points_px and radius_px" in refused(
        str(tmp_path / "lines.npz"), "-o", str(tmp_path / "a.glb")
    )
    save_postures(tmp_path / "bad.npz", replace(swim(), model=fish_model("eel", 90.0)))
    with np.load(tmp_path / "bad.npz") as held:
        np.savez(tmp_path / "bad.npz", **{**held, "half_width": np.ones(5)})
    words = str(tmp_path / "bad.npz"), "-o", str(tmp_path / "a.glb")
    assert "half_width and half_height must be 41 numbers each" in refused(*words)


def test_heights_that_synthesise_wrote_are_kept(tmp_path: Path) -> None:
    at = np.linspace(0.0, 1.0, 21)
    points = np.stack([np.tile(-at, (5, 1)), np.zeros((5, 21))], axis=-1)
    rise = 0.3 * at + 0.05 * np.arange(5)[:, None]
    np.savez(tmp_path / "hill.npz", points=points, rate_hz=25.0, length_m=1.0, height_m=rise)
    made("snake", "--animate", str(tmp_path / "hill.npz"), "-o", str(tmp_path / "s.glb"))
    player = GltfPlayer.read(tmp_path / "s.glb")
    for k in range(5):
        np.testing.assert_allclose(player.bones(k)[:, 1, 3], rise[k, :-1], atol=1e-5)


def test_a_log_is_read_back_pose_by_pose(log: Path, tmp_path: Path) -> None:
    """The bones are the robot's links, where its own kinematics and its pose put them."""
    facts = made("snake", "--animate", str(log), "-o", str(tmp_path / "s.glb"), "--fps", "10")
    record = read_log(log / "log.mcap")
    robot, player = record.header.robot, GltfPlayer.read(tmp_path / "s.glb")
    assert facts["bones"] == robot.joint_count + 1
    assert facts["length_m"] == pytest.approx(robot.length_m)
    pose, half = record.pose, 0.5 * robot.mean_link_length_m
    time_s = pose.time_s - pose.time_s[0]
    for frame, at_s in enumerate(player.time_s):
        row = int(np.abs(time_s - at_s).argmin())
        assert time_s[row] == pytest.approx(at_s, abs=1e-6)
        head = BodyPose(0.0, pose.head_m[row], pose.rotation[row])
        body = body_in_world(robot, head, record.cycle.measured_rad[row])
        front = player.bones(frame)[:, :3, 3] @ Y_UP
        np.testing.assert_allclose(front, body.link_m + half * body.forward, atol=2e-6)
        centre = front - half * body.forward  # beside what the simulator measured, bit by bit
        np.testing.assert_allclose(centre, pose.links_m[row], atol=0.01)


def test_on_the_ground_the_skin_lies_as_deep_as_the_robots_belly(log: Path, tmp_path: Path) -> None:
    made("snake", "--animate", str(log), "-o", str(tmp_path / "s.glb"))
    record = read_log(log / "log.mcap")
    rest = GltfPlayer.read(tmp_path / "s.glb").attribute("POSITION") @ Y_UP
    bind = GltfPlayer.read(tmp_path / "s.glb").tree["nodes"][2]["translation"][2]
    assert bind - rest[:, 2].min() == pytest.approx(record.header.robot.body_radius_m, abs=1e-6)


@pytest.mark.slow
def test_a_mesh_keeps_its_corners_and_colours_and_moves(tmp_path: Path) -> None:
    """Written, read back along other axes, animated: at rest the mesh is what was given."""
    made("trout", "-o", str(tmp_path / "trout.glb"))
    facts = made(
        str(tmp_path / "trout.glb"), "--animate", "subcarangiform", "-o", str(tmp_path / "t.glb")
    )
    given = trimesh.load_scene(tmp_path / "trout.glb").to_mesh()
    player = GltfPlayer.read(tmp_path / "t.glb")
    rest = player.attribute("POSITION")
    assert len(rest) == len(given.vertices)
    shift = (rest - given.vertices).mean(axis=0)
    np.testing.assert_allclose(rest - shift, given.vertices, atol=1e-6)
    assert facts["surface_off_mesh_mean"] < 0.02  # type: ignore[operator]
    assert player.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] == 0


def test_an_obj_that_lies_another_way_is_turned(tmp_path: Path) -> None:
    """Head along -z, y up: the same body as ours turned by hand."""
    solid = trimesh.creation.icosphere(subdivisions=3)
    solid.apply_scale([0.2, 0.1, 1.0])
    solid.export(tmp_path / "a.obj")
    found = read_mesh(tmp_path / "a.obj", "-z", None)
    assert (found.forward, found.up) == ("-z", "+y")
    np.testing.assert_allclose(np.ptp(found.mesh.vertices, axis=0), [2.0, 0.4, 0.2], rtol=0.02)
    head = solid.vertices[:, 2].argmin()
    assert found.mesh.vertices[:, 0].argmax() == head
    assert body_skin(str(tmp_path / "a.obj"), Cut(forward="-z", curves=12)).skin.length_m > 1.99


@pytest.mark.slow
def test_the_surface_through_a_meshs_curves_wears_its_colours(tmp_path: Path) -> None:
    made("tropical-fish", "-o", str(tmp_path / "f.obj"))
    how = ("--surface", "--curves", "15")
    made(str(tmp_path / "f.obj"), *how, "-o", str(tmp_path / "s.obj"))
    given, copied = (np.asarray(Image.open(tmp_path / f"{n}.png"), float) for n in "fs")
    np.testing.assert_allclose(given.mean(axis=(0, 1)), copied.mean(axis=(0, 1)), atol=25.0)


@pytest.mark.slow_cases(5, "19 cases of 0.2 s of CPU")
@pytest.mark.fast_cases(4)
@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("shark", "-o", "a.obj", "--animate", "thunniform"), "a.obj: a skin that moves"),
        (("shark", "-o", "a.glb", "--animate", "sidewinding"), "moves a robot, not a spine"),
        (("shark", "-o", "a.glb", "--animate", "none.csv"), "none.csv: no such recording"),
        (("shark", "-o", "a.glb", "--animate", "none.mcap"), "none.mcap: No such file"),
        (("shark", "-o", "a.glb", "--animate", "thunniform", "--fps", "9"), "24 frames"),
        (("shark", "-o", "a.glb", "--animate", "worm-like", "--fps", "0.01"), "0.1 to 1000"),
        (("shark", "-o", "a.glb", "--fps", "9"), "--fps: is for --animate"),
        (("shark", "-o", "a.glb", "--posed"), "--posed: is for recordings with widths"),
        (("shark", "-o", "a.glb", "--surface"), "--surface: is for a mesh"),
        (("worm-like", "-o", "a.glb", "--curves", "20"), "--curves: is for a skin"),
        (("worm-like", "-o", "a.glb", "--curves", "0"), "--curves: is for a skin"),
        (("worm-like", "-o", "a.glb", "--order", "9"), "--order: is for a skin"),
        (("worm-like", "-o", "a.glb", "--frame", "-5"), "--frame: needs --image or --posed"),
        (("shark", "-o", "a.glb", "--fps", "0"), "--fps: is for --animate"),
        (("worm-like", "-o", "a.glb", "--posed", "--animate", "worm-like"), "--posed: --animate"),
        (("shark", "-o", "a.glb", "--curves", "5"), "curves: a body with round tips needs 12"),
        (("shark", "-o", "a.glb", "--order", "9"), "order 1 (creased), 2 or 3, not 9"),
        (("none.obj", "-o", "a.glb"), "none.obj: no such file"),
        (("none.toml", "-o", "a.glb"), "none.toml: no such file"),
        (("text.obj", "-o", "a.glb"), "text.obj:"),
        (("flat.obj", "-o", "a.glb"), "flat.obj: no plane across it finds a closed loop"),
        (("flat.obj", "-o", "a.glb", "--forward", "north"), "expected one of +x"),
        (("flat.obj", "-o", "a.glb", "--forward", "x", "--up", "-x"), "are one axis"),
    ],
)
def test_faults_are_told(
    words: tuple[str, ...], fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text.obj").write_text("no mesh\n")
    Path("flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    if "--animate" in words and words[0] == "shark":
        words += ("--curves", "12")  # a coarse skin is made sooner
    assert fault in refused(*words)
    assert not list(tmp_path.glob("a.*"))


def test_a_skin_of_ones_own_is_checked(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    section = "{{ at = {}, half_width = {}, half_height = 0.02 }}"
    rows = [section.format(at, wide) for at, wide in ((0.0, 0.01), (0.4, 0.0), (0.3, 0.02))]
    file.write_text(f'name = "m"\nsource = "o"\nsections = [{", ".join(rows)}]\nscales = 3\n')
    fault = refused(str(file), "-o", str(tmp_path / "a.glb"))
    assert "scales: unknown key" in fault
    assert "sections" in fault
