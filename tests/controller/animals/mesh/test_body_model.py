"""The body's cross sections, mesh, texture and files against bodies whose size is known."""

import json
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image
from pydantic import ValidationError

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.animals.mesh.body_model import (
    BodyModel,
    Silhouettes,
    body_model,
    read_silhouettes,
    spindle,
    straight,
)
from snakewalk.controller.animals.mesh.mesh import body_mesh
from snakewalk.controller.animals.mesh.skin_texture import unroll
from snakewalk.controller.images.mesh_files import write_mesh
from snakewalk.controller.mechanics.ground_step import GroundStep, half_heights_m
from snakewalk.sim.rendering.looks import Scene, dressed_model
from tests.helpers.command import snakewalk

LINE = np.stack([90.0 - np.linspace(0.0, 80.0, 41), np.full(41, 20.0)], axis=-1)  # head at right
WIDTH = 4.0 + 2.0 * np.sin(np.linspace(0.0, np.pi, 41))


def picture() -> np.ndarray:
    """Left of a body that faces right is up: red there, green on its right, blue background."""
    image = np.zeros((41, 100, 3), np.uint8)
    image[..., 2] = 255
    for x in range(100):
        half = np.interp(90.0 - x, np.linspace(0.0, 80.0, 41), WIDTH) if 10 <= x <= 90 else 0.0
        for y in range(41):
            if abs(y - 20) <= half:
                image[y, x] = (255, 0, 0) if y < 20 else (0, 255, 0) if y > 20 else (128, 128, 0)
        if 70 < x <= 90:
            image[:, x] = image[:, x] // 2  # the front quarter is darker
    return image


def test_cross_sections_are_the_median_of_the_frames_over_the_length() -> None:
    points = np.stack([LINE, 3.0 * LINE, np.full_like(LINE, np.nan)])
    radius = np.stack([WIDTH, 3.0 * WIDTH, WIDTH])
    model = body_model(Silhouettes(points, radius, 0.5, pixels=True), aspect=0.7)
    wanted = np.interp(np.linspace(0, 1, 101), np.linspace(0, 1, 41), WIDTH) / 80.0
    np.testing.assert_allclose(model.half_width, wanted, atol=1e-12)
    np.testing.assert_allclose(model.half_height, 0.7 * wanted, atol=1e-12)
    side = Silhouettes(points, 0.5 * radius, None, pixels=True)
    both = body_model(Silhouettes(points, radius, 0.5, pixels=True), side)
    np.testing.assert_allclose(both.half_height, 0.5 * wanted, atol=1e-12)
    assert max(both.profile) == 1.0
    # means over an eighth of the body: 4 + 2 sin from 0 to pi / 16 in front
    front = 4 + 2 * (1 - np.cos(np.pi / 16)) / (np.pi / 16)
    assert both.profile[0] == pytest.approx(front / 6, abs=0.01)


def test_a_straight_even_body_has_the_volume_of_its_ellipses_and_is_closed() -> None:
    """A spheroid-capped elliptic cylinder; the rings are polygons, a little inside."""
    a, b = 0.05, 0.04
    mesh = body_mesh(BodyModel(np.full(101, a), np.full(101, b), None, measured=True), straight())
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    cylinder, caps = np.pi * a * b * (1.0 - 2.0 * a), 4.0 / 3.0 * np.pi * a * b * a
    assert solid.volume == pytest.approx(cylinder + caps, rel=0.01)  # outwards: positive
    low, high = solid.bounds
    np.testing.assert_allclose(low, [-1.0, -a, 0.0], atol=1e-3)
    np.testing.assert_allclose(high, [0.0, a, 2 * b], atol=1e-3)
    outwards = ((solid.vertices - solid.centroid) * mesh.normals).sum(axis=1)
    assert np.median(outwards) > 0.0
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-9)


def test_upper_and_lower_side_show_the_same_pixel() -> None:
    mesh = body_mesh(spindle(2.0), straight())
    middle = int(np.argmin(np.abs(mesh.uv[:-2:32, 0] - 0.5)))
    ring = slice(middle * 32, (middle + 1) * 32)
    z, uv = mesh.vertices[ring, 2], mesh.uv[ring]
    np.testing.assert_allclose(uv, uv[(-np.arange(32)) % 32], atol=1e-12)
    assert np.ptp(z) == pytest.approx(2.0 * 2.0 * spindle().half_height[50], rel=1e-6)
    left = mesh.vertices[ring][np.argmax(uv[:, 1])]
    assert left[1] > 0.0  # v = 1 is the animal's left


def test_the_texture_is_the_body_alone_with_left_in_the_first_row() -> None:
    strip = unroll(picture(), LINE, WIDTH)
    assert strip.shape == (64, 512, 3)
    assert strip[:26, 150:, 0].min() > 120  # left: red
    assert strip[38:, 150:, 1].min() > 120  # right: green
    assert strip[4:-4, 12:-12, 2].max() < 60  # background does not show
    assert strip[10, 60, 0] < 140 < strip[10, 200, 0]  # the head's end is the dark one


@pytest.mark.parametrize("ending", ["obj", "glb"])
def test_files_load_again_with_texture(ending: str, tmp_path: Path) -> None:
    mesh = body_mesh(spindle(0.9), straight())
    strip = unroll(picture(), LINE, WIDTH)
    files = write_mesh(tmp_path / f"body.{ending}", mesh, strip)
    assert len(files) == (3 if ending == "obj" else 1)
    loaded = trimesh.load(files[0], process=False)
    one = loaded if isinstance(loaded, trimesh.Trimesh) else next(iter(loaded.geometry.values()))
    assert len(one.faces) == len(mesh.faces)
    up = 2 if ending == "obj" else 1
    assert one.extents[0] == pytest.approx(0.9, abs=1e-4)
    assert one.extents[up] == pytest.approx(2 * 0.9 * spindle().half_height.max(), abs=1e-4)
    material = one.visual.material
    image = material.image if ending == "obj" else material.baseColorTexture
    np.testing.assert_array_equal(np.asarray(image.convert("RGB")), strip)
    if ending == "obj":
        np.testing.assert_allclose(one.visual.uv, mesh.uv, atol=1e-5)
    side = one.vertices[np.argmax(one.visual.uv[:, 1])]
    assert side[1 if ending == "obj" else 2] * (1 if ending == "obj" else -1) > 0.0


def write_track(path: Path, **more: object) -> None:
    np.savez(path, points_px=np.stack([LINE, LINE]), radius_px=np.stack([WIDTH] * 2), **more)


def test_the_command_writes_reports_and_does_not_overwrite(tmp_path: Path) -> None:
    write_track(tmp_path / "t.npz", length_m=0.4)
    Image.fromarray(picture()).save(tmp_path / "0.png")
    words = [
        "animal", "body", str(tmp_path / "t.npz"), "--image", str(tmp_path / "0.png"),
        "-o", str(tmp_path / "b.obj"), "--json",
    ]  # fmt: skip
    done = snakewalk(*words)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert [Path(f).name for f in facts["files"]] == ["b.obj", "b.mtl", "b.png"]
    assert facts["thickest_over_length"] == pytest.approx(12.0 / 80.0, rel=0.01)
    RobotConfig(name="x", joint_axes="yyyy", body_profile=tuple(facts["body_profile"]))
    again = snakewalk(*words)
    assert again.returncode == 2
    assert "b.obj: exists; --force" in again.stderr
    assert snakewalk(*words, "--force", "--posed").returncode == 0


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nosuch.npz", "-o", "b.glb"], "nosuch.npz: no such file"),
        (["t.npz", "-o", "b.stl"], "written as .obj or .glb"),
        (["t.npz", "-o", "b.glb", "--image", "none.png"], "none.png: no such file"),
        (["t.npz", "-o", "b.glb", "--image", "t.npz"], "cannot be read as a picture"),
        (["t.npz", "-o", "b.glb", "--image", "small.png"], "does not lie in this picture"),
        (["t.npz", "-o", "b.glb", "--posed", "--frame", "7"], "frame 7 is not in 0..1"),
        (["t.npz", "-o", "b.glb", "--aspect", "0"], "aspect: height over width"),
        (["worm-like", "-o", "b.glb", "--image", "small.png"], "made from figures"),
        (["t.npz", "-o", "nowhere/b.glb"], "nowhere: no such folder"),
    ],
)
def test_bad_input_is_one_line(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_track(tmp_path / "t.npz")
    Image.fromarray(picture()[:30, :30]).save("small.png")
    done = snakewalk("animal", "body", *words)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert said in done.stderr
    assert not (tmp_path / "b.glb").exists()


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    from snakewalk.config.errors import InputError

    for held, said in (
        ({"points_px": np.zeros((2, 9, 2)), "radius_px": np.ones((2, 5))}, "does not fit"),
        ({"points_px": np.zeros((9, 2)), "radius_px": np.ones(9)}, "must be"),
        ({"radius_px": np.ones(9)}, "found radius_px"),
    ):
        np.savez(tmp_path / "bad.npz", **held)
        with pytest.raises(InputError, match=said):
            read_silhouettes(tmp_path / "bad.npz")
    lost = Silhouettes(np.full((2, 9, 2), np.nan), np.ones((2, 9)), None, pixels=True)
    with pytest.raises(InputError, match="no frame contains"):
        body_model(lost)


def test_radii_of_segments_serve_as_well(tmp_path: Path) -> None:
    np.savez(
        tmp_path / "s.npz", points=np.stack([LINE]) / 100, radius_m=np.full(40, 0.03), length_m=0.8
    )
    seen = read_silhouettes(tmp_path / "s.npz")
    assert not seen.pixels
    np.testing.assert_allclose(body_model(seen).half_width, 0.03 / 0.8)


def leg(file: Path, bend_px: float, root_px: float, tip_px: float) -> None:
    """Photograph a leg of 400 px between the middles of its round ends, root upwards."""
    s = np.linspace(0.0, 1.0, 400)
    image = np.full((520, 240), 200, np.uint8)
    x = 120.0 + bend_px * np.sin(np.pi * s)
    radii = root_px + (tip_px - root_px) * s
    for at in np.column_stack([x, 60.0 + 400.0 * s, radii]):
        across, down, radius = (round(16.0 * float(value)) for value in at)
        cv2.circle(image, (across, down), radius, 60, -1, cv2.LINE_AA, 4)
    noise = np.random.default_rng(0).normal(0.0, 3.0, image.shape)
    cv2.imwrite(str(file), np.clip(image + noise, 0.0, 255.0).astype(np.uint8))


@pytest.mark.parametrize("flipped", [False, True])
def test_two_photographs_of_a_leg_make_its_ellipses(flipped: bool, tmp_path: Path) -> None:
    """[KP] 4.1: a part of a goat or lizard; it is bent from the side, and thicker there."""
    views = {"front": (0.0, 14.0, 5.0), "side": (25.0, 24.0, 7.0)}
    for view, (bend, root, tip) in views.items():
        leg(tmp_path / f"{view}.png", bend, root, tip)
        if flipped:
            image = cv2.imread(str(tmp_path / f"{view}.png"))
            assert image is not None
            cv2.imwrite(str(tmp_path / f"{view}.png"), image[::-1])
    front, side = (read_silhouettes(tmp_path / f"{view}.png") for view in views)
    root_row = 460.0 if flipped else 60.0
    assert front.points[0, 0, 1] == pytest.approx(root_row, abs=20.0)
    part = body_model(front, side)
    for silhouettes, half, (_, root, tip) in (
        (front, part.half_width, views["front"]),
        (side, part.half_height, views["side"]),
    ):
        length_px = np.hypot(*np.diff(silhouettes.points[0], axis=0).T).sum()
        along_px = np.linspace(0.0, length_px, 101) - root
        known_px = root + (tip - root) * along_px / (length_px - root - tip)
        middle = slice(10, 91)
        np.testing.assert_allclose(half[middle] * length_px, known_px[middle], atol=2.0)
    mesh = body_mesh(part, straight())
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight


def test_a_picture_without_a_part_is_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.full((60, 80), 128, np.uint8))
    with pytest.raises(InputError, match=r"a\.png: .*photograph one body alone"):
        read_silhouettes(tmp_path / "a.png")


def test_a_real_worm_in_its_picture(shared_data: Path, tmp_path: Path) -> None:
    """Dark animal, light ground: the strip must be darker than the picture everywhere."""
    folder = shared_data / "worm-images"
    seen = read_silhouettes(folder / "skeletons.npz")
    strip = unroll(
        np.asarray(Image.open(folder / "frames" / "00192.png")), seen.points[0], seen.radius[0]
    )
    around = np.asarray(Image.open(folder / "frames" / "00192.png"))
    assert strip[16:48].mean() < np.percentile(around, 90) - 20
    model = body_model(seen)
    assert 0.05 < model.half_width.max() < 0.07
    mesh = body_mesh(model, straight())
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight


PROFILE = (0.5, 1.0, 0.8, 0.2)


def test_the_robot_s_profile_is_the_look_s_skin() -> None:
    robot = load_robot("yaw16")
    shaped = robot.model_copy(update={"body_profile": PROFILE})
    radii = shaped.radii_m(4)
    assert radii == pytest.approx([p * robot.body_radius_m for p in PROFILE])
    assert robot.radii_m(5) == pytest.approx([robot.body_radius_m] * 5)
    skins = []
    for one in (robot, shaped):
        model = dressed_model(Scene(one, load_world("flat"), None))
        skin = [
            float(model.geom_size[g, 0])
            for g in range(model.ngeom)
            if model.geom_group[g] == 1
            and model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE
            and model.body(int(model.geom_bodyid[g])).name not in ("link0", "world")
        ]
        assert len(skin) == 16
        skins.append(skin)
    middles = (np.arange(17) + 0.5) / 17
    wanted = robot.body_radius_m * np.interp(middles, np.linspace(0, 1, 4), PROFILE)
    np.testing.assert_allclose(skins[1], wanted[1:], atol=1e-12)
    assert skins[0][8] > skins[0][-1]


def test_the_robot_s_profile_is_the_ground_step_s_heights() -> None:
    robot = load_robot("yaw16").model_copy(update={"body_profile": PROFILE})
    half = half_heights_m(robot, 51)
    placed = GroundStep(None).place(np.zeros(51), (0.0, 0.0), robot.length_m / 51, half)
    np.testing.assert_allclose(placed.points_m[:, 2], half, atol=1e-9)
    steps = np.linalg.norm(np.diff(placed.points_m, axis=0), axis=1)
    np.testing.assert_allclose(steps, robot.length_m / 51, rtol=1e-9)


@pytest.mark.parametrize("profile", [(1.0,), (0.0, 1.0), (1.0, 1.2)])
def test_a_profile_is_relative(profile: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError, match="body_profile"):
        RobotConfig(name="x", joint_axes="yyyy", body_profile=profile)
