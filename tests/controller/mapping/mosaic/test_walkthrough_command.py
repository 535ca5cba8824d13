"""``snakewalk world walkthrough``: two positions of a ravine to a film and a world."""

import json
from pathlib import Path

import av
import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load, load_world
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.mapping.mosaic.walk import read_walk
from tests.oracles.motorcycle import true_depth, write_motorcycle
from tests.oracles.ravine import Camera, Station, station, write_route

CAMERA = Camera((240, 180), 200.0)
PLACES_M = (0.6, 1.1)


@pytest.fixture(scope="module")
def route(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_route(tmp_path_factory.mktemp("route"), PLACES_M, CAMERA, fine=1)


def call(*words: object) -> dict:
    found = CliRunner().invoke(app, [*map(str, words), "--json"])
    assert found.exit_code == 0, found.exception or found.output
    return json.loads(found.stdout)


def refused(*words: object) -> str:
    found = CliRunner().invoke(app, ["world", "walkthrough", *map(str, words)])
    assert isinstance(found.exception, InputError), found.output
    return str(found.exception)


@pytest.mark.slow
def test_two_positions_become_a_film_and_a_world(route: Path, tmp_path: Path) -> None:
    film, world, mesh = (tmp_path / name for name in ("film.mp4", "ravine.toml", "place.glb"))
    made = call(
        "world", "walkthrough", route, "-o", film, "--size", "240x180", "--fps", 4,
        "--seconds", 1, "--world", world, "--spacing", 0.03, "--mesh", mesh,
    )  # fmt: skip
    assert made["inliers"][0] > 40
    assert made["place_error_mm"][0] < min(10.0, 4.0 * made["place_sd_mm"][0])
    assert made["angle_error_mrad"][0] < 5.0
    assert made["hole_share"] < 0.12
    assert set(made["facts"]) == {"quantity", "unit", "order"}
    frames = [f.to_ndarray(format="rgb24") for f in av.open(str(film)).decode(video=0)]
    assert len(frames) == made["frames"] == 5
    one, two = (station(x) for x in PLACES_M)
    middle = Station(0.5 * (one.at_m + two.at_m), np.linalg.qr(one.axes + two.axes)[0])
    middle.axes[:] *= np.sign((middle.axes * one.axes).sum(axis=0))
    truth, depth = CAMERA.look(middle, fine=1)
    near = np.isfinite(depth)
    near[:, :40] = near[:, -20:] = False
    off = np.abs(frames[2].astype(float) - truth).mean(axis=-1)[near]
    still = np.abs(frames[0].astype(float) - truth).mean(axis=-1)[near]
    assert np.median(off) < 8.0
    assert np.median(off) < 0.6 * np.median(still)
    ground = build_ground(load_world(str(world)))
    assert ground is not None
    assert ground.known is not None
    assert 0.2 < ground.known.mean() < 0.95
    assert ground.colour is not None
    assert ground.colour[ground.known].std(axis=0).min() > 10.0
    place = trimesh.load_scene(mesh)
    right, up, back = np.concatenate([part.vertices for part in place.geometry.values()]).T
    assert len(place.geometry) == 2
    assert all(part.visual.material.baseColorTexture.size == (240, 180)
               for part in place.geometry.values())  # fmt: skip
    assert b"KHR_materials_unlit" in mesh.read_bytes()
    column = np.rint((-back - ground.x0_m) / ground.spacing_m).astype(int)
    row = np.rint((-right - ground.y0_m) / ground.spacing_m).astype(int)
    off = up - ground.z_m[row, column]  # the lowest sample of a map is 0
    assert np.median(np.abs(off - np.median(off))) < 0.02


def test_a_real_pair_is_a_single_position(tmp_path: Path) -> None:
    """Middlebury's motorcycle at half the size; depths against its truth."""
    folder, film = tmp_path / "motorcycle", tmp_path / "film.mp4"
    file = write_motorcycle(folder, smaller=2)
    words = ["world", "walkthrough", str(file), "-o", str(film), "--size", "160x120"]
    found = CliRunner().invoke(app, [*words, "--fps", "2", "--seconds", "1"])
    assert found.exit_code == 0, found.exception or found.output
    assert "valid share" in found.output
    assert "mm (stated by its format)" in found.output
    assert "matches" not in found.output  # there is no next position
    frames = [f.to_ndarray(format="rgb24") for f in av.open(str(film)).decode(video=0)]
    assert len(frames) == 4
    assert np.abs(frames[1].astype(float) - frames[3]).mean() > 2.0  # the camera moves
    (model,) = read_walk(file, load(file, WalkthroughConfig)).models
    depth = true_depth(smaller=2)
    both = model.valid & np.isfinite(depth)
    assert both.mean() > 0.6
    error = np.abs(model.points_m[..., 2][both] / depth[both] - 1.0)
    assert np.median(error) < 0.01
    assert (error < 0.05).mean() > 0.9


def test_bad_input_is_reported_with_its_place(route: Path, tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    assert "a film ends in .mp4" in refused(route, "-o", tmp_path / "film.avi")
    assert "must be even numbers" in refused(route, "-o", film, "--size", "241x180")
    assert "--size big: must be even numbers" in refused(route, "-o", film, "--size", "big")
    assert "add --world" in refused(route, "-o", film, "--picture", tmp_path / "a.png")
    file = route.with_name("other.toml")
    text = route.read_text()
    file.write_text(text.replace('"1-left.png"', '"7-left.png"'))
    assert "position 2: " in (said := refused(file, "-o", film))
    assert "7-left.png: no such file" in said
    file.write_text(text.replace('left = "1-left.png"', ""))
    assert "left and right belong together" in refused(file, "-o", film)
    file.write_text(text.replace('"1-left.png"', '"1-right.png"'))
    assert "fewer than 1 %" in refused(file, "-o", film)
    file.write_text(text.split("[[positions]]")[0])
    assert "positions" in refused(file, "-o", film)
