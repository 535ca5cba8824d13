"""``snakewalk world``: from a file to a world that is planned on; what is refused."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_world
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.mapping.stereo_ground import CameraStand
from snakewalk.controller.terrain.planner import TerrainPlanner

pytestmark = pytest.mark.usefixtures("legible_figures")


def call(*words: object) -> dict[str, object]:
    found = CliRunner().invoke(app, [*map(str, words), "--json"])
    assert found.exit_code == 0, found.exception or found.output
    return json.loads(found.stdout)


def refused(*words: object) -> str:
    found = CliRunner().invoke(app, [*map(str, words)])
    assert isinstance(found.exception, InputError), found.output
    return str(found.exception)


def hollow(folder: Path) -> Path:
    """Level ground of 12 m by 8 m in centimetres, with a hole in its middle."""
    z = np.zeros((81, 121))
    z[30:51, 50:71] = -1.0
    np.savez(folder / "level.npz", elevation=z)
    return folder / "level.npz"


def test_a_file_becomes_a_world_that_is_planned_on(tmp_path: Path) -> None:
    file, world = hollow(tmp_path), tmp_path / "level.toml"
    picture = tmp_path / "level.png"
    made = call(
        "world",
        "from",
        file,
        "-o",
        world,
        "--cell",
        10,
        "--unit",
        "cm",
        "--no-data",
        -1,
        "--picture",
        picture,
    )
    assert made["size_m"] == [12.0, 8.0]
    assert made["known_share"] == pytest.approx(1 - 441 / (81 * 121), abs=1e-4)
    assert picture.stat().st_size > 10_000
    assert "95.5 % of the samples are known" in world.read_text()
    held = load_world(str(world))
    planner = TerrainPlanner(build_ground(held), held.planner)
    assert planner.plan([(-3.0, 0.0), (3.0, 0.0)]).length_m > 6.1  # around the hole
    with pytest.raises(InputError, match="ground that the world's map does not know"):
        planner.plan([(-3.0, 0.0), (0.5, 0.0)])


@pytest.mark.costs("runs the command for each fault")
def test_what_is_wrong_is_said_and_nothing_is_written(tmp_path: Path) -> None:
    file, world = hollow(tmp_path), tmp_path / "w.toml"
    words = ("world", "from", file, "-o", world)
    for more, expected in (
        (("--scale", -1), "--scale -1: must be from 1e-06 to 1e+06"),
        (("--spacing", 0), "--spacing 0: must be from 1e-06 to 1e+06"),
        (("--fill", -1), "--fill -1: must be 0 or more"),
        (("--crop", "1,2,3"), "expected X0,Y0,X1,Y1 in metres"),
        (("--crop", "3,0,1,1"), "X1 must be over X0"),
        (("--cell", 0.1, "--picture", tmp_path / "a.txt"), "a picture ends in"),
        ((), "--cell"),
        (("--cell", 1, "--spacing", 0.001), "are over 4000000"),
        (("--cell", 0.1, "--unit", "deg"), "states no latitude"),
    ):
        assert expected in refused(*words, *more)
    assert "a world's file ends in .toml" in refused("world", "from", file, "-o", "w")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["level.npz"]
    (tmp_path / "w-map.npz").write_bytes(file.read_bytes())
    own = ("world", "from", tmp_path / "w-map.npz", "-o", world, "--cell", 0.1)
    assert "w-map.npz: exists" in refused(*own)
    assert "is read, and would be overwritten" in refused(*own, "--force")


def test_a_stereo_pair_becomes_a_world_in_the_frame_of_its_camera(tmp_path: Path) -> None:
    """Level ground with a grain, by its homography, from two ideal cameras 0.6 m above it."""
    rng = np.random.default_rng(8)
    texels = rng.normal(size=(900, 900))
    grain = sum(gaussian_filter(texels, s) * s for s in (0.8, 2.0, 5.0))
    grain = 120 + 45 * grain / grain.std()
    f, tilt, height_m, baseline_m = 260.0, 0.6, 0.6, 0.1
    turn = CameraStand(height_m, tilt, 0.0).world_from_camera()
    v, u = np.mgrid[:240, :320] - np.array([119.5, 159.5])[:, None, None]
    ray = np.stack([u / f, v / f, np.ones_like(u)], axis=-1) @ turn.T
    for name, shift in (("l.png", 0.0), ("r.png", -baseline_m)):
        place = ray[..., :2] * (-height_m / ray[..., 2:]) + [0.0, shift]
        at = np.moveaxis(place / 0.004 + [0.0, 450.0], -1, 0)  # a texel is 4 mm
        cv2.imwrite(str(tmp_path / name), np.clip(map_coordinates(grain, at, order=3), 0, 255))
    k = [[f, 0.0, 159.5], [0.0, f, 119.5], [0.0, 0.0, 1.0]]
    np.savez(tmp_path / "c.npz", K1=k, K2=k, R=np.eye(3), T=[-1000 * baseline_m, 0.0, 0.0])
    pair = ("world", "stereo", tmp_path / "l.png", tmp_path / "r.png")
    plain = (*pair, "--calibration", tmp_path / "c.npz", "-o", tmp_path / "y.toml")
    words = (*plain, "--unit", "mm")
    made = call(*words, "--disparities", 64, "--far", 1.5, "--spacing", 0.04)
    assert made["camera"] == "fitted to the points, which are assumed to be level ground"
    assert made["camera_height_m"] == pytest.approx(height_m, abs=0.005)
    assert made["camera_tilt_deg"] == pytest.approx(np.degrees(tilt), abs=0.3)
    assert made["camera_roll_deg"] == pytest.approx(0.0, abs=0.3)
    ground = build_ground(load_world(str(tmp_path / "y.toml")))
    assert 0.2 < ground.known.mean() < 0.95  # a fan in its box
    assert np.ptp(ground.z_m[ground.known]) < 0.03
    assert np.std(ground.z_m[ground.known]) < 0.005
    assert ground.x0_m > 0.2  # the ground below the camera is not in the picture
    text = (tmp_path / "y.toml").read_text()
    assert "0.60" in text
    assert "fitted to the points" in text
    for more, expected in (
        (("--unit", "mm", "--height", 1), "--height and --tilt belong together"),
        (("--level-ground", "--height", 1, "--tilt", 3), "--level-ground fits the ground"),
        (("--unit", "mm", "--roll", 3), "--roll belongs to --height and --tilt"),
        (("--unit", "mm", "--error", 0), "--error 0: must be from 1e-06 to 1e+06"),
        (("--unit", "mm", "--error", 1e-6), "nothing in the pictures is matched, or all is too"),
    ):
        assert expected in refused(*plain, "--force", *more)
    (tmp_path / "l.png").write_bytes(b"no picture")
    assert "l.png: cannot be read as a picture" in refused(*words, "--force")
