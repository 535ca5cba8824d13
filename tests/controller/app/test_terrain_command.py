"""``snakewalk terrain``: from a file to a world that is planned on; what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_world
from snakewalk.controller.app.cli.command_line import app
from snakewalk.controller.terrain.planner import TerrainPlanner


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
        "terrain",
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


def test_what_is_wrong_is_said_and_nothing_is_written(tmp_path: Path) -> None:
    file, world = hollow(tmp_path), tmp_path / "w.toml"
    words = ("terrain", "from", file, "-o", world)
    for more, expected in (
        (("--scale", -1), "--scale -1: must be above 0"),
        (("--spacing", "nan"), "--spacing nan: must be above 0"),
        (("--fill", -1), "--fill -1: must be 0 or more"),
        (("--unit", "parsec"), "is none of m, cm, mm, km, ft, deg"),
        (("--point", "best"), "is none of lowest, median, highest"),
        (("--up", "x"), "is none of z, y"),
        (("--crop", "1,2,3"), "expected X0,Y0,X1,Y1 in metres"),
        (("--crop", "3,0,1,1"), "X1 must be over X0"),
        (("--cell", 0.1, "--picture", tmp_path / "a.txt"), "a picture ends in"),
        ((), "--cell"),
        (("--cell", 1, "--spacing", 0.001), "are over 4000000"),
        (("--cell", 0.1, "--unit", "deg"), "says no latitude"),
    ):
        assert expected in refused(*words, *more)
    assert "a world's file ends in .toml" in refused("terrain", "from", file, "-o", "w")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["level.npz"]
    (tmp_path / "w-map.npz").write_bytes(file.read_bytes())
    own = ("terrain", "from", tmp_path / "w-map.npz", "-o", world, "--cell", 0.1)
    assert "w-map.npz: exists" in refused(*own)
    assert "is read, and would be overwritten" in refused(*own, "--force")
